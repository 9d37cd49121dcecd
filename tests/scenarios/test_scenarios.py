"""Every packaged scenario at every link delay, with real processes over UDP: `make proof`."""

import numpy as np
import pytest

from sitl.scenario.spec import load
from tests.scenarios import memory
from tests.scenarios.__main__ import compared, fly_all
from tests.scenarios.designs import design_file, design_for
from tests.scenarios.page import PAGE, page
from tests.scenarios.wire import fly

BAD_LINK = """
title = "a bad link"
hover_altitude_m = 1.0
[gyro]
noise_dbw = -68.0
[disturbance]
bandwidth_hz = 1.0
peak_attitude_error_rad = { roll = 0.15, pitch = 0.12, yaw = 0.12 }
[windows]
lead_s = 1.0
length_s = 2.0
settle_s = 1.0
[clock]
grid_us = 2500
[[event]]
kind = "link"
answers_lost = 0.1
jitter_samples = 2
[[check]]
measure = "lost"
at_least = 0.05
"""


@pytest.mark.proof
def test_every_scenario_keeps_its_word_at_every_delay_and_the_page_shows_it(tmp_path):
    flights = fly_all(compared(), tmp_path, seed=1, workers=2)
    text = page(flights, seed=1)
    print(text)
    assert [(f.scenario, f.delay, f.last_words) for f in flights if f.code] == []
    assert PAGE.read_text("utf-8") == text, "older than the code: python -m tests.scenarios --write"


def test_a_scenario_flown_over_the_wire_is_the_flight_in_memory(tmp_path):
    """Real processes and sockets against bytes in memory, over a link that loses and delays: the same to the bit."""
    scenario = tmp_path / "bad.toml"
    scenario.write_text(BAD_LINK)
    flown = fly(str(scenario), design_file(tmp_path, 1), 1, tmp_path / "out")
    assert flown.code == 0, flown.last_words
    in_memory = memory.fly(load(str(scenario)), design_for(1)).log.arrays()
    over_wire = np.load(tmp_path / "out" / "flight.npz")
    for name in ("gyro", "u_e", "correction", "age", "answered", "state"):
        assert over_wire[name].tobytes() == in_memory[name].tobytes(), name
