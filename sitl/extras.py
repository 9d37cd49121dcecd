"""What to type when a package of an extra is missing."""

import os
import sys
from pathlib import Path
from shlex import join

_TOP = Path(__file__).resolve().parents[1]


def remedy(missing: ModuleNotFoundError, extra: str) -> str:
    """One line: what is not there, and the command that brings it, from a checkout by the interpreter that runs."""
    name = (missing.name or "").partition(".")[0]
    if not (_TOP / "pyproject.toml").exists():
        return f"{name} is not installed; install dob-companion again, with its extra [{extra}]"
    source = "." if Path.cwd() == _TOP else str(_TOP)
    python = os.path.relpath(sys.executable) if Path(sys.executable).is_relative_to(Path.cwd()) else sys.executable
    pins = "constraints.txt" if source == "." else str(_TOP / "constraints.txt")
    command = join([python, "-m", "pip", "install", "-c", pins, "-e", f"{source}[{extra}]"])
    return f"{name} is not installed: {command}"
