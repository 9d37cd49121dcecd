"""What a campaign file and its options make: flights, and one line for each mistake."""

import pytest

from sitl.campaign.cli import main
from sitl.campaign.keys import read
from sitl.campaign.progress import Progress


@pytest.fixture
def campaign(tmp_path, design, short):
    """Writes a campaign file that names design and scenario beside what is given."""

    def write(text=""):
        path = tmp_path / "campaign.toml"
        path.write_text(f'designs = ["paper={design}"]\nscenario = "{short}"\n{text}')
        return path

    return write


def test_every_seed_is_flown_in_every_combination(campaign):
    path = campaign("seeds = 3\nfirst_seed = 7\ndelays = [0, 2]\ngain = [0.8, 1.0, 1.2]")
    flights = read(path, {}).flights()
    assert [flight.flight for flight in flights] == list(range(18))
    assert {flight.seed for flight in flights} == {7, 8, 9}
    assert {(f.delay, f.gain) for f in flights if f.seed == 8} == {(d, g) for d in (0, 2) for g in (0.8, 1.0, 1.2)}
    assert {(f.airframe, f.pole, f.wind_m_s) for f in flights} == {("linear", 1.0, None)}


def test_what_is_drawn_is_drawn_once_a_seed_and_does_not_shift_other_draws(campaign):
    one = read(campaign("seeds = 50\ndelays = [1, 2]\npole = { from = 0.5, to = 2 }"), {}).flights()
    two = read(
        campaign("seeds = 50\ndelays = [1, 2]\npole = { from = 0.5, to = 2 }\ngain = { from = 0.9, to = 1.1 }"), {}
    )
    poles = {flight.seed: flight.pole for flight in one}
    assert len(set(poles.values())) == 50
    assert 0.5 < min(poles.values()) < 0.7
    assert 1.8 < max(poles.values()) < 2.0
    assert all(flight.pole == poles[flight.seed] for flight in (*one, *two.flights()))


def test_options_win_over_the_file(campaign):
    flights = read(campaign("seeds = 3\ndelays = [1, 2]"), {"seeds": 2, "delays": [3]}).flights()
    assert [(flight.seed, flight.delay) for flight in flights] == [(1, 3), (2, 3)]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("sedes = 3", "sedes: unknown key; did you mean 'seeds'?"),
        ("seeds = 0", "seeds: is 0, expected a whole number from 1 to"),
        ("seeds = true", "seeds: is True, expected a whole number"),
        ("delays = [1, 1]", "delays: is [1, 1], expected different whole numbers from 0 to 20"),
        ("delays = []", "delays: is [], expected different whole numbers"),
        ("gain = nan", "gain: is nan, expected different numbers, or { from = …, to = … }"),
        ("gain = { from = 2, to = 1 }", "gain: is {'from': 2, 'to': 1}, expected different numbers"),
        ('airframes = "glider"', "airframes: is 'glider', expected different ones of linear, tailsitter"),
        ("wind_m_s = 4", "wind_m_s: the linear airframe feels no wind"),
        ("[parameters]\nDOB_LIMT = 1", "parameters.DOB_LIMT: unknown; expected one of DOB_AXES"),
        ("[parameters]\nDOB_LIMIT = 2", "parameters.DOB_LIMIT: is 2, expected a number from 0 to 1"),
        ("seeds = ", "not TOML"),
    ],
)
def test_a_mistake_in_the_file_is_one_line_that_names_it(campaign, tmp_path, capsys, text, expected):
    path = campaign(text)
    assert main([str(path), "-o", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"campaign: {path}: {expected}")
    assert not (tmp_path / "out").exists()


def test_a_mistake_among_the_options_names_the_option(design, tmp_path, capsys):
    out = tmp_path / "out"
    for given, expected in (
        (["--seeds", "5"], "--designs: expected at least one design.json"),
        (["--designs", f"{tmp_path}/none.json"], f"{tmp_path}/none.json: cannot be read"),
        (["--designs", f"{design},{design}"], "--designs: two designs are called 'paper'"),
        (["--designs", str(design), "--delays", "99"], "--delays: is [99], expected"),
        (["--designs", str(design), "--scenario", "papr"], "scenario 'papr' is unknown; did you mean 'paper'?"),
        (["--designs", str(design), "--scenario", "calm"], "scenario 'calm' has no end"),
    ):
        assert main([*given, "-o", str(out)]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert line.startswith(f"campaign: {expected}")


def test_a_directory_of_something_else_is_not_touched(campaign, flown, tmp_path, capsys):
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "letter.txt").write_text("dear")
    assert main([str(campaign()), "-o", str(tmp_path / "full")]) == 2
    assert "holds other files" in capsys.readouterr().err
    assert [path.name for path in (tmp_path / "full").iterdir()] == ["letter.txt"]
    out, _, _ = flown
    before = (out / "campaign.json").read_bytes()
    assert main([str(campaign("seeds = 5")), "-o", str(out)]) == 2
    assert "holds another campaign" in capsys.readouterr().err
    assert (out / "campaign.json").read_bytes() == before


def test_a_damaged_directory_is_told_in_one_line(tmp_path, capsys):
    for content in ("", "{}", "[]", '{"schema": "other/1", "campaign": {}, "disturbance": {}}'):
        (tmp_path / "campaign.json").write_text(content)
        assert main(["replay", str(tmp_path), "--flight", "0", "-o", str(tmp_path / "out")]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert line.startswith(f"campaign: {tmp_path / 'campaign.json'}: damaged")


def test_a_flight_that_is_not_there_cannot_be_replayed(flown, tmp_path, capsys):
    out, _, rows = flown
    assert main(["replay", str(out), "--flight", str(len(rows)), "-o", str(tmp_path)]) == 2
    assert f"--flight {len(rows)}: expected a number from 0 to {len(rows) - 1}" in capsys.readouterr().err


def test_progress_says_how_much_time_is_left(monkeypatch, capsys):
    clock = iter((100.0, 110.0))
    monkeypatch.setattr("sitl.campaign.progress.monotonic", lambda: next(clock))
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    progress = Progress(total=1000, done=100)
    progress.add(9)
    assert capsys.readouterr().err.endswith("109 of 1000 flights, 10 %, 0.9/s, 16:30 left")
