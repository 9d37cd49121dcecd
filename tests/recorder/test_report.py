"""The page of a recorded flight: its numbers are those of the flight, and its text is whole and offline."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mav

from dob_companion.analysis.flight import OFF_STATES, ON_STATES, spectrum, time_in_states, without_samples
from dob_companion.analysis.recorded import FlightReader
from dob_companion.companion import Companion, parse_config
from dob_companion.errors import InputError
from dob_companion.files.playback import play
from dob_companion.files.recorder import FlightRecorder
from dob_companion.files.segments import traces_at
from dob_companion.report.recorded_charts import rates, timeline
from dob_companion.report.recorded_page import recorded_page
from dob_companion.supervisor import State, ages
from tests.companion.aircraft import DT, Aircraft, corrections, small_design, texts
from tests.recorder.flights import Told, end, recorded, run
from tests.report.html import Page
from tests.report.test_browser import _worked, chromium  # noqa: F401

OFF, ON, HZ = 0.2, 0.05, 3.0


def shake(plane, count, amplitude):
    """A vibration of one frequency on pitch; the moment is left alone."""
    for _ in range(count):
        plane.rates = (0.0, amplitude * np.sin(2.0 * np.pi * HZ * DT * plane.sample), 0.0)
        plane.pair()


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """Off for 8 s, on for 8 s with a quarter of the vibration, off again."""
    directory = tmp_path_factory.mktemp("flights")
    with recorded(directory) as plane:
        plane.heartbeat()
        shake(plane, 2000, OFF)
        plane.write("DOB_ENABLE", 1.0)
        plane.until(State.ACTIVE)
        shake(plane, 2000, ON)
        plane.write("DOB_ENABLE", 0.0)
        plane.until(State.DISABLED)
        plane.pairs(10)
    return directory, plane


@pytest.fixture(scope="module")
def flight(flown):
    reader = FlightReader()
    for path in traces_at(flown[0]):
        play(path, reader)
    return reader.flight("flight")


def test_every_sample_answer_and_change_of_state_is_in_it(flown, flight):
    _, plane = flown
    assert len(flight.time) == plane.sample
    assert flight.seconds == pytest.approx((plane.sample - 1) * DT)
    answers = np.array([(m.x, m.y, m.z) for m in corrections(plane.said)])
    np.testing.assert_array_equal(flight.correction, answers)
    said = [text for text in texts(plane.said) if text.startswith("DOB ")]
    assert [f"DOB {change.state.name}: {change.reason}" for change in flight.changes] == said
    assert {"RAMP_IN", "ACTIVE", "RAMP_OUT", "DISABLED"} <= {change.state.name for change in flight.changes}
    assert len(flight.told) == len([m for m in plane.said if m.get_type() == "DEBUG_FLOAT_ARRAY"])


def test_time_in_the_states_adds_up_to_the_flight(flight):
    times = time_in_states(flight)
    assert sum(times.values()) == pytest.approx(flight.seconds)
    assert times[State.ACTIVE] == pytest.approx(2000 * DT, abs=0.1)
    assert times[State.RAMP_OUT] == pytest.approx(0.5, abs=0.05)


def test_the_vibration_is_found_in_its_band_with_its_root_mean_square(flight):
    off, on = spectrum(flight, OFF_STATES), spectrum(flight, ON_STATES)
    band, elsewhere = (1.0, 5.0), (10.0, 25.0)
    assert off.rms(band)[1] == pytest.approx(OFF / np.sqrt(2.0), rel=0.02)
    assert on.rms(band)[1] == pytest.approx(ON / np.sqrt(2.0), rel=0.02)
    assert on.rms()[1] == pytest.approx(on.rms(band)[1], rel=0.02)
    assert off.rms(elsewhere)[1] < 0.01 * OFF
    assert off.rms(band)[0] == 0.0


def test_what_was_not_flown_is_not_compared(flight):
    assert spectrum(replace(flight, flying=np.zeros_like(flight.flying)), OFF_STATES) is None
    broken = flight.stamp_us + 40_000 * (np.arange(len(flight.stamp_us)) // 500)
    assert spectrum(replace(flight, stamp_us=broken), OFF_STATES) is None
    deaf = flight.gyro.copy()
    deaf[::500] = np.nan
    assert spectrum(replace(flight, gyro=deaf), ON_STATES) is None


def test_a_clock_that_restarts_does_not_turn_the_flight_time_back(tmp_path):
    with recorded(tmp_path) as plane:
        plane.heartbeat()
        plane.pairs(100)
        plane.sample = 0
        plane.now += 2.0
        plane.pairs(100)
    reader = FlightReader()
    play(traces_at(tmp_path)[0], reader)
    flight = reader.flight("flight")
    assert np.all(np.diff(flight.time) > 0.0)
    assert flight.seconds == pytest.approx(198 * DT + 2.0, abs=0.05)


def read(directory):
    reader = FlightReader()
    for path in traces_at(directory):
        play(path, reader)
    return reader.flight("flight")


def silence(plane, seconds):
    """Time passes in the daemon; the vehicle says nothing."""
    for _ in range(round(seconds / 0.05)):
        plane.now += 0.05
        plane.listen()


HOLE = 12
"""Samples that are missing in a row, more than the design bears."""


@pytest.fixture(scope="module")
def rebooted(tmp_path_factory):
    """Injecting, 28 gaps, 8 s without a word while the autopilot reboots, the same stamps again, and 6 s of silence."""
    directory = tmp_path_factory.mktemp("rebooted")
    with recorded(directory) as plane:
        plane.active()
        plane.rates = (0.2, 0.0, 0.0)
        plane.pairs(250)
        plane.write("DOB_GAIN", 0.5)
        plane.write("DOB_AXES", 3.0)
        for _ in range(28):
            plane.sample += HOLE
            plane.now += HOLE * DT
            plane.pairs(180)
        flown, answers = plane.sample, corrections(plane.said)
        silence(plane, 8.0)
        plane.rates, plane.sample = (0.1, 0.0, 0.0), 0
        answers += plane.pairs(1000)
        silence(plane, 6.0)
    return answers, flown, read(directory)


def test_a_second_boot_with_the_same_stamps_leaves_the_answers_of_the_first_alone(rebooted):
    answers, _, flight = rebooted
    again = int(np.flatnonzero(np.diff(flight.stamp_us) < 0)[0]) + 1
    assert len(flight.stamp_us) - again == 1000
    assert set(flight.stamp_us[again:]) & set(flight.stamp_us[:again])
    np.testing.assert_array_equal(flight.correction, [(m.x, m.y, m.z) for m in answers])
    assert np.any(flight.correction[:again])
    assert np.any(flight.correction[again:])
    assert flight.restarts == (pytest.approx(flight.time[again]),)


def test_a_pause_counts_for_no_state_and_what_follows_the_last_sample_is_there(rebooted):
    _, flown, flight = rebooted
    times, lost = time_in_states(flight), without_samples(flight)
    assert sum(times.values()) + lost == pytest.approx(flight.seconds)
    assert lost == pytest.approx(8.0 + 6.0 + 28 * (HOLE + 1) * DT, abs=0.1)
    assert flight.seconds == pytest.approx((flown + 1000) * DT + 14.0, abs=0.1)
    tail = [change for change in flight.changes if change.time > flight.time[-1]]
    assert [change.state for change in tail] == [State.RAMP_OUT, State.WAITING]
    assert tail[0].time == pytest.approx(flight.time[-1] + 0.5, abs=0.1)


def test_no_line_is_drawn_across_a_hole(rebooted):
    _, _, flight = rebooted
    drawn = [curve for chart in (timeline(flight), rates(flight)) for panel in chart.panels for curve in panel.curves]
    for curve in drawn:
        if curve.name == "state":
            continue
        lines = np.isfinite(curve.y[:-1]) & np.isfinite(curve.y[1:])
        usual = 5 * DT if "estimate" in curve.name else DT
        assert np.all(np.diff(curve.x)[lines] < 5.0 * usual), curve.name  # peaks are kept, others thinned


def test_axes_are_drawn_on_one_scale_and_states_by_name(rebooted):
    _, _, flight = rebooted
    state, *moments = timeline(flight).panels
    assert state.y.names == tuple(each.name for each in State)
    assert len({(panel.y.low, panel.y.high) for panel in moments}) == 1
    assert len({(panel.y.low, panel.y.high) for panel in rates(flight).panels}) == 1


def test_many_changes_are_told_together_and_settings_with_their_changes(rebooted):
    page = Page(recorded_page(rebooted[2], "flight"))
    told = next(row for row in page.rows if row[:2] == ["RAMP_OUT", "gap in samples"])
    assert told[2] == "28 times"
    settings = [row for row in page.rows if len(row) == 3 and row[1].startswith("DOB_")]
    assert ["start", "DOB_GAIN", "1"] in settings
    assert ["DOB_GAIN", "0.5"] in [row[1:] for row in settings]
    assert ["DOB_AXES", "3 (roll, pitch)"] in [row[1:] for row in settings]
    assert [row[0] for row in settings].count("start") == 5


def test_samples_that_come_twice_or_late_are_no_samples_of_the_page(tmp_path):
    with recorded(tmp_path) as plane:
        plane.heartbeat()
        plane.pairs(100)
        plane.deliver(plane.imu(stamp=plane.stamp - 4000))
        plane.deliver(plane.imu(stamp=plane.stamp - 40_000))
        plane.pairs(100)
    flight = read(tmp_path)
    assert len(flight.time) == 200
    assert flight.restarts == ()


def test_the_page_follows_the_system_that_was_configured_and_not_the_first_one_heard(tmp_path):
    companion = Companion(small_design(), parse_config("system = 1", "configuration"))
    recorder = FlightRecorder(tmp_path, companion, small_design(), "system = 1", now=0.0)
    plane = Aircraft(Told(companion, recorder))
    plane.deliver(mav.MAVLink_heartbeat_message(2, 12, 128, 0, 4, 3), by=mav.MAVLink(None, 7, 1))
    plane.pairs(10)
    end(recorder)
    assert len(read(tmp_path).time) == 10


def test_the_page_follows_from_one_vehicle_to_another_that_takes_its_place(tmp_path):
    with recorded(tmp_path) as plane:
        plane.pairs(10)
        silence(plane, ages.VEHICLE_S + 1.0)
        plane.out = mav.MAVLink(None, 7, 1)
        plane.heartbeat()
        plane.pairs(5)
    assert len(read(tmp_path).time) == 15


def test_the_page_is_whole_offline_and_says_what_the_comparison_is_worth(flown, capsys, tmp_path):
    out = tmp_path / "flight.html"
    code, printed, err = run(capsys, "report", flown[0], "-o", out)
    assert (code, err) == (0, "")
    assert str(out) in printed
    text = out.read_text(encoding="utf-8")
    page = Page(text)
    assert len(page.ids) == len(set(page.ids))
    assert {"timeline", "rates", "spectra", "histograms", "states", "changes", "comparison"} <= set(page.ids)
    assert all(address.startswith(("#", "data:,")) for address in page.addresses)
    assert "The disturbance was not the same." in text
    ratio = next(row for row in page.rows if row and row[0] == "1–5 Hz")[6]
    assert float(ratio) == pytest.approx(OFF / ON, rel=0.02)
    assert ["RAMP_OUT", "switched off"] in [row[1:] for row in page.rows]


def test_a_flight_that_was_never_on_says_that_there_is_nothing_to_compare(flight):
    never = replace(flight, state=np.zeros_like(flight.state), changes=())
    text = recorded_page(never, "flight")
    Page(text)
    assert re.search(r"nowhere long enough in\s+ACTIVE", text)
    assert "The state never changed." in text


def test_words_from_the_link_cannot_leave_their_place(flight):
    hostile = "<script>alert(1)</script>"
    changes = tuple(replace(change, reason=hostile) for change in flight.changes)
    text = recorded_page(replace(flight, changes=changes, machine=hostile), hostile)
    assert hostile not in text
    Page(text)


def test_a_torn_trace_gives_a_page_and_a_note(flown, capsys, tmp_path):
    whole = traces_at(flown[0])[0].read_bytes()
    torn = tmp_path / "torn.dobtrace"
    torn.write_bytes(whole[: len(whole) * 2 // 3])
    code, printed, _ = run(capsys, "report", torn, "-o", tmp_path / "torn.html", "--json")
    assert code == 0
    assert "middle of a write" in json.loads(printed)["notes"][0]
    Page((tmp_path / "torn.html").read_text(encoding="utf-8"))


def test_what_is_neither_flight_nor_design_is_one_line_and_exit_2(capsys, tmp_path):
    (tmp_path / "x.json").write_text("{")
    for source in (tmp_path / "x.json", tmp_path, tmp_path / "nowhere"):
        code, _, err = run(capsys, "report", source, "-o", tmp_path / "page.html")
        assert code == 2
        assert len(err.splitlines()) == 1
        assert str(source) in err


def test_a_recording_without_a_vehicle_has_no_page(tmp_path):
    with recorded(tmp_path) as plane:
        plane.beats = False
        plane.listen()
    reader = FlightReader()
    play(traces_at(tmp_path)[0], reader)
    with pytest.raises(InputError, match="no gyro samples"):
        reader.flight("flight")


def test_the_page_of_a_design_is_the_one_that_design_writes(capsys, tmp_path):
    from dob_companion.artifact import dumps
    from tests.report.material import design_page, one_block

    path = tmp_path / "design.json"
    text, sealed = dumps(one_block())
    path.write_text(text, encoding="utf-8")
    assert run(capsys, "report", path, "-o", tmp_path / "design.html")[0] == 0
    assert (tmp_path / "design.html").read_text(encoding="utf-8") == design_page(sealed)


def test_the_figures_answer_in_a_browser(chromium, flight, tmp_path):  # noqa: F811
    seen, console = _worked(chromium, tmp_path, recorded_page(flight, "flight"), ["timeline", "rates", "spectra"])
    assert console == []
    assert all(one["zoomed"] > 0 and one["reset"] == 0 for one in seen.values())
    assert "DOB_STATE" in seen["timeline"]["hover"]
