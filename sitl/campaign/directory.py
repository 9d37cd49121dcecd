"""A campaign's directory: begun once, gone on with later, and enough to fly any of its flights again."""

import dataclasses
import fcntl
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import sha256
from importlib.resources import files
from pathlib import Path
from typing import Any

from dob_companion import __version__
from sitl.attitude import Vector
from sitl.calibration import disturbance_scale
from sitl.campaign.keys import checked
from sitl.campaign.pilot import Job
from sitl.campaign.plan import Between, Campaign, Inputs, Values
from sitl.campaign.store import Store, replace
from sitl.errors import InputError, ScenarioError
from sitl.scenario.spec import Scenario, load

SCHEMA = "dob-companion/campaign/1"


class Directory:
    """An open campaign: what it flies, how strong its disturbance is, and its rows.

    `scale` is the disturbance's size by airframe (see `calibration`): found once, by flying the first seed
    without plant errors, so that every flight of a campaign meets weather of the same strength.
    """

    def __init__(self, path: Path, campaign: Campaign, scenario: Scenario, scale: dict[str, Vector]) -> None:
        self.path, self.campaign, self.scenario = path, campaign, scenario
        self.flights = campaign.flights()
        self.store = Store(path)
        self._scale = scale

    def job(self, inputs: Inputs) -> Job:
        """What it takes to fly one of the flights."""
        campaign = self.campaign
        scale = self._scale[inputs.airframe]
        return Job(inputs, self.scenario, scale, campaign.designs[inputs.design], campaign.parameters)


@contextmanager
def begun(path: Path, campaign: Campaign) -> Iterator[Directory]:
    """The directory of `campaign`: begun when new, gone on with when it is this very campaign's; locked meanwhile.

    Raises InputError when it holds anything else or is in use.
    """
    scenario = load(campaign.scenario)
    if scenario.windows is None:
        raise ScenarioError(f"scenario {campaign.scenario!r} has no end; expected one with [windows]")
    try:
        path.mkdir(parents=True, exist_ok=True)
        handle = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    except OSError as error:
        raise InputError(f"-o {path}: cannot be a directory: {error.strerror}") from None
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise InputError(f"-o {path}: another campaign is writing there") from None
        if not (path / "campaign.json").exists():
            _begin(path, campaign, scenario)
        found = opened(path)
        same = dataclasses.replace(found.campaign, scenario="") == dataclasses.replace(campaign, scenario="")
        if not same or found.scenario != scenario:
            raise InputError(f"-o {path}: holds another campaign; expected a new directory, or the same campaign")
        yield found
    finally:
        os.close(handle)


def opened(path: Path) -> Directory:
    """The campaign that a directory holds. Raises InputError."""
    file = path / "campaign.json"
    try:
        content = json.loads(file.read_text("utf-8"))
        keys, scale = dict(content["campaign"]), content["disturbance"]
        scale = {name: (float(v["roll"]), float(v["pitch"]), float(v["yaw"])) for name, v in scale.items()}
        if content["schema"] != SCHEMA:
            raise ValueError
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror}") from None
    except (ValueError, KeyError, TypeError, AttributeError):
        raise InputError(f"{file}: damaged; expected {SCHEMA}") from None
    campaign = checked(keys, file, {})
    return Directory(path, campaign, load(campaign.scenario), scale)


def _begin(path: Path, campaign: Campaign, scenario: Scenario) -> None:
    if {entry.name for entry in path.iterdir()} - {"scenario", "designs"}:  # these two may be of a begin cut short
        raise InputError(f"-o {path}: holds other files; expected a new directory, or one of this campaign")
    scale = {
        name: disturbance_scale(dataclasses.replace(scenario, airframe=name), campaign.first_seed)
        for name in campaign.airframes
    }
    for folder in ("scenario", "designs"):
        (path / folder).mkdir(exist_ok=True)
    replace(path / "scenario" / f"{scenario.name}.toml", _file_of(campaign.scenario).read_bytes())
    for name, text in campaign.designs.items():
        replace(path / "designs" / f"{name}.json", text.encode())
    content = {
        "schema": SCHEMA,
        "generator": f"dob-companion {__version__}",
        "flights": len(campaign.flights()),
        "campaign": _content(campaign),
        "disturbance": {k: dict(zip(("roll", "pitch", "yaw"), v, strict=True)) for k, v in scale.items()},
        "sha256": {name: sha256(text.encode()).hexdigest() for name, text in campaign.designs.items()},
    }
    replace(path / "campaign.json", (json.dumps(content, indent=2) + "\n").encode())


def _content(campaign: Campaign) -> dict[str, Any]:
    """The campaign under the keys of a campaign file, with everything it names inside the directory."""
    return {
        "scenario": f"scenario/{Path(campaign.scenario).stem}.toml",
        "designs": [f"{name}=designs/{name}.json" for name in campaign.designs],
        "seeds": campaign.seeds,
        "first_seed": campaign.first_seed,
        "airframes": list(campaign.airframes),
        "delays": list(campaign.delays),
        "gain": _plain(campaign.gain),
        "pole": _plain(campaign.pole),
        "parameters": dict(campaign.parameters),
    } | ({"wind_m_s": _plain(campaign.wind_m_s)} if campaign.wind_m_s else {})


def _plain(values: Values) -> object:
    return {"from": values.low, "to": values.high} if isinstance(values, Between) else list(values)


def _file_of(scenario: str) -> Path:
    """The file that `sitl.scenario.load` reads for this name or path."""
    path = Path(scenario)
    return path if path.suffix == ".toml" else Path(str(files("sitl"))) / "scenarios" / f"{scenario}.toml"
