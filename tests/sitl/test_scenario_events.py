"""Events: read from a file, each at its sample in both windows, and undone between them."""

from dataclasses import replace
from math import inf
from pathlib import Path

import numpy as np
import pytest

from sitl.airframe.condition import Condition
from sitl.autopilot.aircraft import linear
from sitl.errors import ScenarioError
from sitl.flight import Flight
from sitl.scenario.script import Phase
from sitl.scenario.spec import Scenario, load
from tests.sitl.bench import SHORT

SCALE = (0.1, 0.06, 0.17)


def scenario(tmp_path: Path, *tables: str) -> Scenario:
    path = tmp_path / "events.toml"
    path.write_text(SHORT + "\n" + "\n".join(tables))
    return load(str(path))


def event(kind: str, **keys: object) -> str:
    words = {True: "true", False: "false"}
    lines = [
        f"{k} = {v if isinstance(v, int | float) and not isinstance(v, bool) else words.get(v, v)}"
        for k, v in keys.items()
    ]
    return "\n".join(["[[event]]", f'kind = "{kind}"', *lines])


def fly(flight: Flight, until: Phase = Phase.COMPLETE) -> Flight:
    for _ in range(5000):
        if flight.script.phase is until:
            return flight
        sample, _ = flight.step()
        flight.answer(sample.stamp_us, (0.0, 0.0, 0.0))
        if flight.script.phase is Phase.WAIT_OBSERVER:
            flight.script.observer_reported(True)
    raise AssertionError(flight.script.phase)


@pytest.mark.parametrize(
    ("table", "field", "value"),
    [
        (event("payload", kg=0.3), "payload_kg", 0.3),
        (event("rotor", rotor=2, effectiveness=0.7), "rotor_effectiveness", (1.0, 0.7, 1.0, 1.0)),
        (event("battery", charge=0.4), "battery_charge", 0.4),
        (event("battery", charge=0.4), "battery_sag", True),
        (event("flexible"), "flexible", True),
        (event("gain", factor=0.7), "gain", (0.7, 0.7, 0.7)),
        (event("hold", axis='"yaw"'), "held_axis", 2),
    ],
)
def test_an_event_changes_the_aircraft_in_both_segments_and_nowhere_else(tmp_path, table, field, value):
    flight = Flight(replace(scenario(tmp_path, table), airframe="linear"), 1)
    seen = {phase: [] for phase in Phase}
    while not flight.complete:
        phase = flight.script.phase
        sample, _ = flight.step()
        flight.answer(sample.stamp_us, (0.0, 0.0, 0.0))
        seen[phase].append(getattr(flight.vehicle.airframe.condition, field))
        if flight.script.phase is Phase.WAIT_OBSERVER:
            flight.script.observer_reported(True)
    usual = getattr(Condition(), field)
    assert set(seen[Phase.CLIMB]) == {usual}
    assert set(seen[Phase.OFF]) == set(seen[Phase.ON]) == {value}
    assert set(seen[Phase.SETTLE]) == {usual}


def test_an_event_comes_at_its_sample_of_window_time_in_both_windows(tmp_path):
    flight = fly(Flight(scenario(tmp_path, event("gyro_bias", at_s=0.4, rad_s="{ pitch = 0.5 }")), 1, SCALE))
    a = flight.log.arrays()
    for window in (1, 2):
        rows = a["window"] == window
        bias = np.round((a["gyro"] - a["rate"])[rows, 1], 1)
        np.testing.assert_array_equal(bias, np.where(np.arange(250) < 100, 0.0, 0.5))


def test_what_the_aircraft_had_before_take_off_is_what_it_is_given_back(tmp_path):
    aircraft = linear()
    aircraft.airframe.condition.gain = (1.2, 1.2, 1.2)
    flight = Flight(scenario(tmp_path, event("gain", factor=0.7)), 1, SCALE, aircraft=aircraft)
    fly(flight, Phase.OFF)
    flight.step()
    assert flight.vehicle.airframe.condition.gain == (0.7, 0.7, 0.7)
    fly(flight, Phase.SETTLE)
    flight.step()
    assert flight.vehicle.airframe.condition.gain == (1.2, 1.2, 1.2)


def test_a_wall_and_another_height_are_asked_for_and_taken_back(tmp_path):
    tables = event("wall", distance_m=0.8), event("altitude", altitude_m=3.0)
    flight = fly(Flight(scenario(tmp_path, *tables), 1, SCALE), Phase.OFF)
    flight.step()
    assert (flight._stage.wall_m, flight.vehicle.target_altitude) == (0.8, 3.0)
    fly(flight, Phase.SETTLE)
    flight.step()
    assert (flight._stage.wall_m, flight.vehicle.target_altitude) == (inf, 1.0)


def test_a_doublet_is_plus_minus_and_level_again(tmp_path):
    doublet = event("doublet", axis='"pitch"', at_s=0.2, amplitude_rad=0.2, period_s=0.4)
    flight = Flight(scenario(tmp_path, doublet), 1)
    commands = []
    while not flight.complete:
        inside = flight.script.window
        sample, _ = flight.step()
        flight.answer(sample.stamp_us, (0.0, 0.0, 0.0))
        if inside:
            commands.append(flight.vehicle.attitude_command[2])
        if flight.script.phase is Phase.WAIT_OBSERVER:
            flight.script.observer_reported(True)
    off, on = np.array(commands[:250]), np.array(commands[250:])
    np.testing.assert_array_equal(off, on)
    half = np.sin(0.1)
    expected = np.select([np.arange(250) < n for n in (50, 100, 150)], [0.0, half, -half], 0.0)
    np.testing.assert_allclose(off, expected, atol=1e-12)


def test_wind_and_events_begin_with_hover_where_there_are_no_windows(tmp_path):
    path = tmp_path / "hover.toml"
    calm = 'title = "hover"\nhover_altitude_m = 1.0\n[gyro]\nnoise_dbw = -68.0\n'
    path.write_text(calm + "[wind]\nmean_m_s = 3.0\n" + event("gain", at_s=0.4, factor=0.5))
    flight = fly(Flight(load(str(path)), 1), Phase.HOVER)
    gains = []
    for _ in range(200):
        flight.step()
        gains.append(flight.vehicle.airframe.condition.gain[0])
    assert gains == [1.0] * 100 + [0.5] * 100
    assert flight.log.arrays()["wind"][-200:, 0] == pytest.approx(-3.0)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (event("payloads", kg=1), r"event\[1\].kind: 'payloads' is unknown; did you mean 'payload'"),
        (event("payload", kilos=1), r"event\[1\].kg: expected a number from 0 to 100"),
        (event("payload", kg=1, at=3), r"event\[1\].at: unknown key; did you mean 'at_s'"),
        (event("payload", kg=1, at_s=1.5), r"event\[1\].at_s: expected a number from -0.2 to 1"),
        (event("rotor", rotor=1.5, effectiveness=0.5), r"event\[1\].rotor: expected a whole number"),
        (event("hold", axis='"pich"'), r"event\[1\].axis: 'pich' is unknown; did you mean 'pitch'"),
        (event("gyro_bias", rad_s="{ pich = 1.0 }"), r"event\[1\].rad_s.pich: unknown key; did you mean 'pitch'"),
        ("[event]\nkind = 3", r"event: expected tables, each headed \[\[event\]\]"),
        (event("link", answers_lost=1.5), r"event\[1\].answers_lost: expected a number from 0 to 1"),
        ("[wind]\nmean_m_s = 0.1\nturbulence_m_s = 5.0", "wind.mean_m_s: expected a number from 0.5"),
        ("[wind]\nmean_m_s = 3\nturbulence_m_s = 5", "wind.span_m: expected a number"),
        ('[[check]]\nmeasure = "rms_ration"\nat_least = 1', r"check\[1\].measure: .*did you mean 'rms_ratio'"),
        ('[[check]]\nmeasure = "rms_ratio"', r"check\[1\].at_least: expected at_least, at_most or both"),
        ('[[check]]\nmeasure = "rms_ratio"\nat_least = "1"', r"check\[1\].at_least: expected a number"),
        ('[[check]]\nmeasure = "state"\nstate = "active"\nat_least = 1', r"check\[1\].state: 'active' is unknown"),
        ("[clock]\ngrid = 2500", "clock.grid: unknown key; did you mean 'grid_us'"),
    ],
)
def test_a_bad_table_is_named_with_its_number_and_key(tmp_path, table, message):
    with pytest.raises(ScenarioError, match=message) as error:
        scenario(tmp_path, table)
    assert "events.toml" in str(error.value)
    assert "\n" not in str(error.value)


def test_an_unknown_airframe_names_the_known_ones(tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text('airframe = "xyz"\n' + SHORT)
    with pytest.raises(ScenarioError, match="airframe: 'xyz' is unknown; expected one of linear, tailsitter"):
        load(str(path))
