"""deploy/px4's core (Correction.hpp), compiled here and flown in simulated time."""

import ctypes
import shutil
import struct
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[2]
MODULE = ROOT / "deploy" / "px4" / "src" / "modules" / "dob_correction"
COMPILER = shutil.which("g++") or shutil.which("clang++")
TAKEN, MALFORMED, OUT_OF_ORDER, OUT_OF_TIME = range(4)
WARNINGS = ("-Wall", "-Wextra", "-Werror", "-Wdouble-promotion", "-Wfloat-equal")


def compiled(directory: Path) -> ctypes.CDLL:
    """The core as a shared library in `directory`, with the warnings that PX4 compiles with."""
    library = directory / "core.so"
    command = [COMPILER, "-std=c++14", "-O1", *WARNINGS, "-fPIC", "-shared", f"-I{MODULE}"]
    subprocess.run([*command, str(Path(__file__).with_name("core.cpp")), "-o", str(library)], check=True)
    core = ctypes.CDLL(str(library))
    core.create.restype = ctypes.c_void_p
    core.age_us.restype = ctypes.c_float
    core.step.argtypes = (ctypes.c_void_p, ctypes.c_uint64, ctypes.c_int, ctypes.c_float, *[ctypes.c_void_p] * 2)
    core.take.argtypes = (ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_uint64)
    core.fresh.argtypes = core.age_us.argtypes = (ctypes.c_void_p, ctypes.c_uint64)
    core.destroy.argtypes = (ctypes.c_void_p,)
    return core


@dataclass
class Flight:
    """A multirotor in hover with the core in its rate loop. Time passes in `run` and `converse` only."""

    core: ctypes.CDLL
    now_us: int = 20_000_000
    let_in: bool = True
    thrust: float = 0.4
    limits: tuple[float, float, float] = (0.15, 0.15, 0.15)
    added: tuple[float, float, float] = (0.0, 0.0, 0.0)
    history: list[tuple[int, float]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._self = self.core.create()

    def __del__(self) -> None:
        self.core.destroy(self._self)

    def run(self, seconds: float, step_us: int = 2500) -> None:
        """The rate controller's cycles; keeps time and roll of what is added."""
        for _ in range(round(seconds * 1e6 / step_us)):
            self.now_us += step_us
            self.cycle()

    def cycle(self) -> None:
        """One cycle, now."""
        limits, added = (ctypes.c_float * 3)(*self.limits), (ctypes.c_float * 3)()
        self.core.step(self._self, self.now_us, int(self.let_in), self.thrust, limits, added)
        self.added = tuple(added)
        self.history.append((self.now_us, self.added[0]))

    def hear(self, *moment: float, stamp_us: int | None = None, age_us: int = 4000) -> int:
        """A correction comes in; what became of it."""
        return self.hear_bytes(struct.pack("<Q3f", self.now_us - age_us if stamp_us is None else stamp_us, *moment))

    def hear_bytes(self, payload: bytes) -> int:
        """Any payload comes in."""
        return self.core.take(self._self, payload.ljust(128, b"\0"), len(payload), self.now_us)

    def converse(self, seconds: float, *moment: float) -> None:
        """A companion that sends the same correction at 250 Hz."""
        for _ in range(round(seconds * 250)):
            self.hear(*moment)
            self.run(0.004, 2000)

    @property
    def age_us(self) -> float:
        """As the module reports it."""
        return self.core.age_us(self._self, self.now_us)

    @property
    def fresh(self) -> bool:
        """Whether a correction is there that still holds."""
        return bool(self.core.fresh(self._self, self.now_us))
