"""One short flight for each thing that can happen: the nonlinear tail-sitter and the companion, byte by byte.

`make proof` flies the packaged scenarios themselves, at every delay, over UDP.
"""

from pathlib import Path

import pytest

from sitl.attitude import ZERO, Vector
from sitl.flight import Flight
from sitl.result import verdicts
from sitl.scenario.spec import load, packaged_names
from tests.scenarios.designs import design_for
from tests.scenarios.memory import fly, fly_on_board

DISTURBANCE = """
[disturbance]
bandwidth_hz = 1.0
peak_attitude_error_rad = { roll = 0.05, pitch = 0.04, yaw = 0.04 }
"""
SCALE = (0.012, 0.024, 0.0185)
"""What gives about those peaks; short windows need no search."""

PLACE = """
airframe = "tailsitter"
hover_altitude_m = 2.0
[gyro]
noise_dbw = -68.0
[windows]
lead_s = 1.5
length_s = 4.0
settle_s = 4.0
"""
ATTITUDE_ONLY = '[[event]]\nkind = "attitude_only"\n'
ACTIVE = '[[check]]\nmeasure = "state"\nstate = "ACTIVE"\nat_least = 1.0\n'


def ratio(at_least: float, measure: str = "rms_ratio", more: str = "") -> str:
    return f'[[check]]\nmeasure = "{measure}"\nat_least = {at_least}\n{more}\n'


def event(kind: str, more: str = "") -> str:
    return f'[[event]]\nkind = "{kind}"\n{more}\n'


DISTURBED = {
    "nothing else": ratio(4.0) + ACTIVE,
    "plant gain 30 % low": event("gain", "factor = 0.7") + ratio(4.0) + ACTIVE,
    "plant gain 30 % high": event("gain", "factor = 1.3") + ratio(4.0) + ACTIVE,
    "a payload dropped": event("payload", "kg = 0.1") + event("payload", "kg = 0.0\nat_s = 1.0") + ratio(4.0) + ACTIVE,
    "a rotor at 70 %": event("rotor", "rotor = 1\neffectiveness = 0.7\nat_s = 0.5") + ratio(1.5) + ACTIVE,
    "a sagging battery": event("battery", "charge = 0.35") + ratio(4.0) + ACTIVE,
    "flexible modes": event("flexible") + ratio(4.0) + ACTIVE,
    "a wall": event("wall", "distance_m = 0.5") + ratio(4.0) + ACTIVE,
    "down into ground effect": event("altitude", "altitude_m = 0.5\nat_s = 0.2")
    + ratio(4.0)
    + ratio(1.2, "sink_m")
    + ACTIVE,
    "a gyro bias": event("gyro_bias", "at_s = 1.0\nrad_s = { pitch = -0.02, yaw = 0.02 }") + ratio(2.0) + ACTIVE,
    "stamps of a real autopilot": "[clock]\ngrid_us = 2500\njitter_us = 50\nskew_ppm = 4000\n" + ratio(4.0) + ACTIVE,
    "lost samples and answers": event("link", "pairs_lost = 0.01\nanswers_lost = 0.05")
    + ratio(2.0)
    + '[[check]]\nmeasure = "lost"\nat_least = 0.03\nat_most = 0.1\n',
    "an outage": event("link", "answers_lost = 1.0\nat_s = 1.0")
    + '[[check]]\nmeasure = "correction"\nat_most = 0.0\nfrom_s = 1.25\n'
    + '[[check]]\nmeasure = "largest_error"\nat_most = 0.15\n',
    "answers late by turns": event("link", "jitter_samples = 2") + ratio(3.0) + ACTIVE,
    "a delay step that is borne": event("link", "delay_samples = 1\nat_s = 1.0") + ratio(3.0) + ACTIVE,
    "a delay step that is not": event("link", "delay_samples = 8\nat_s = 1.0")
    + '[[check]]\nmeasure = "correction"\nat_most = 0.0\nfrom_s = 3.0\n'
    + '[[check]]\nmeasure = "delay_samples"\nat_least = 9.0\nat_most = 9.0\nfrom_s = 1.5\n'
    + '[[check]]\nmeasure = "largest_error"\nat_most = 0.15\n',
}


MORE = (
    *("plant gain 30 % high", "a payload dropped", "a sagging battery", "flexible modes", "a wall"),
    *("answers late by turns", "a delay step that is borne"),
)
"""Further changes of plant and link that the same observer bears: flown by `make proof`, as are their scenarios."""

OVER_THE_WIRE = ("nothing else", "stamps of a real autopilot", "lost samples and answers")
"""The clock and the counting of what is lost belong to the wire; one flight is flown there for its own sake."""


def flown(directory: Path, tables: str, scale: Vector = ZERO, *, wire: bool = False) -> Flight:
    path = directory / "short.toml"
    path.write_text('title = "short"\n' + tables)
    how = fly if wire else fly_on_board
    return how(load(str(path)), design_for(1), scale=scale)


def holds(flight: Flight) -> bool:
    found = verdicts(flight)
    assert found
    assert not [v for v in found if not v.passed], found
    return True


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.proof if name in MORE else ()) for name in DISTURBED]
)
def test_a_disturbance_is_rejected_whatever_happens_besides_or_the_companion_lets_go(tmp_path, name):
    tables = PLACE + DISTURBANCE + ATTITUDE_ONLY + DISTURBED[name]
    assert holds(flown(tmp_path, tables, SCALE, wire=name in OVER_THE_WIRE))


def test_the_observer_does_not_fight_the_pilot(tmp_path):
    doublet = 'axis = "pitch"\nat_s = 0.5\namplitude_rad = 0.35\nperiod_s = 1.0'
    leak = '[[check]]\nmeasure = "command_leak"\naxis = "pitch"\nat_most = 0.1\n'
    same = '[[check]]\nmeasure = "rms_ratio"\naxis = "pitch"\nat_least = 0.95\nat_most = 1.05\n'
    assert holds(flown(tmp_path, PLACE + ATTITUDE_ONLY + event("doublet", doublet) + leak + same + ACTIVE))


def test_on_a_rod_only_one_axis_turns_and_the_pull_grows(tmp_path):
    pull = '[disturbance]\nacts_as = "moment"\npeak_attitude_error_rad = { roll = 0.3 }\n'
    pull += "[disturbance.pull]\nfrequency_hz = 1.0\ngrowth_s = 5.5\n"
    rod = 'axis = "roll"'
    checks = ratio(3.0, "peak_ratio", rod) + '[[check]]\nmeasure = "drift_m"\nat_most = 0.01\n' + ACTIVE
    flight = flown(tmp_path, PLACE + pull + event("hold", rod) + checks, (0.5, 0.0, 0.0))
    assert holds(flight)
    a = flight.log.arrays()
    off = a["window"] == 1
    assert not a["rate"][off][:, 1:].any()
    assert abs(a["moment"][off][:, 0]).max() > 0.45
    assert not a["disturbance"].any()


def test_dryden_turbulence_is_felt_on_every_axis_and_the_position_is_kept(tmp_path):
    wind = "[wind]\nmean_m_s = 4.0\nturbulence_m_s = 7.7\nspan_m = 0.9\n"
    checks = ratio(1.05, "rate_ratio", 'axis = "pitch"') + '[[check]]\nmeasure = "drift_m"\nat_most = 2.0\n' + ACTIVE
    flight = flown(tmp_path, PLACE + wind + checks)
    assert holds(flight)
    a = flight.log.arrays()
    assert a["wind"][a["window"] == 1].std(axis=0).min() > 0.05
    assert abs(a["wind"][a["window"] == 0][:500]).max() == 0.0


def test_a_discrete_gust_pitches_the_vehicle_and_less_so_with_the_observer(tmp_path):
    gust = (
        "[wind]\nmean_m_s = 0.0\n[[wind.gust]]\nat_s = 0.5\nrise_s = 0.4\nhold_s = 1.0\npeak_m_s = { north = -4.0 }\n"
    )
    checks = "".join(ratio(5.0, measure, 'axis = "pitch"') for measure in ("rms_ratio", "rate_ratio"))
    assert holds(flown(tmp_path, PLACE + gust + event("feed_forward") + checks + ACTIVE))


def test_the_same_seed_gives_the_same_flight_to_the_bit_over_a_bad_link(tmp_path):
    place = PLACE.replace("length_s = 4.0", "length_s = 1.0").replace("settle_s = 4.0", "settle_s = 1.0")
    tables = place + DISTURBANCE + event("link", "pairs_lost = 0.02\nanswers_lost = 0.1\njitter_samples = 2")
    flights = [flown(tmp_path, tables, SCALE, wire=True) for _ in range(2)]
    first, second = (flight.log.arrays() for flight in flights)
    assert all(first[name].tobytes() == second[name].tobytes() for name in first)


def test_every_packaged_scenario_with_windows_says_what_must_come_out():
    for name in packaged_names():
        scenario = load(name)
        assert bool(scenario.windows) == bool(scenario.checks), name
