"""What to type when a package of an extra is missing."""

import os
import sys
from pathlib import Path
from shlex import join

_EXTRA_OF = {
    **dict.fromkeys(("cvxpy", "clarabel", "control", "scipy", "matplotlib", "jinja2", "markupsafe"), "design"),
    "mavsdk": "mavsdk",
    "rich": "view",
    "sitl": "sitl",
}
_TOP = Path(__file__).resolve().parents[2]


def remedy(missing: ModuleNotFoundError, command: str) -> str | None:
    """One line: what is not there, and how `command`, a command of ours, gets it. None when no extra brings it.

    From a checkout that is a line for the shell, with the interpreter that runs and the versions that are pinned.
    """
    name = (missing.name or "").partition(".")[0]
    extra = _EXTRA_OF.get(name)
    if extra is None:
        return None
    extra = "demo" if command in ("demo", "rehearse") else extra
    if not (_TOP / "pyproject.toml").exists():
        return f"{name} is not installed; install dob-companion again, with its extra [{extra}]"
    here = Path.cwd() == _TOP
    python = os.path.relpath(sys.executable) if Path(sys.executable).is_relative_to(Path.cwd()) else sys.executable
    pins, source = ("constraints.txt", ".") if here else (str(_TOP / "constraints.txt"), str(_TOP))
    return f"{name} is not installed: " + join([python, "-m", "pip", "install", "-c", pins, "-e", f"{source}[{extra}]"])
