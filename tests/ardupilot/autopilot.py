"""As much of ArduPilot as deploy/ardupilot/dob_correction.lua sees: its Lua bindings, around the script itself.

The script runs in a real Lua 5.3, in a sandbox with the functions that ArduPilot leaves it; a name that is not there is
an error. What differs on board: numbers have 32 bits there. tests/ardupilot/test_flights.py flies it in ArduPilot.
"""

import math
import struct
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from lupa.lua53 import LuaError, LuaRuntime

SCRIPT = Path(__file__).parents[2] / "deploy" / "ardupilot" / "dob_correction.lua"
SANDBOX = (
    *("assert", "error", "ipairs", "load", "next", "pairs", "pcall", "setmetatable", "tonumber", "tostring", "type"),
    *("math", "string", "table"),
)
THROTTLE_UNLIMITED, SCRIPTING_MIXER, COPTER, PLANE = 3, 17, 2, 3


@dataclass
class Answer:
    """An ACTUATOR_CONTROL_TARGET that the script has sent."""

    stamp_us: int
    moment: tuple[float, ...]
    thrust: float
    correction: tuple[float, ...]
    age: float


@dataclass
class Autopilot:
    """A multirotor, armed and flying, with the script on board. Time passes in `run` and in writing the mixer."""

    parameters: dict[str, float] = field(default_factory=dict)
    kind: int = COPTER
    now_us: int = 20_000_000
    moment: tuple[float, float, float] = (0.0, 0.0, 0.0)
    throttle: float = 0.4
    spool_state: int = THROTTLE_UNLIMITED
    flying: bool = True
    armed: bool = True
    vtol: bool = True
    pitch: float = 1.5
    switch: int | None = None
    switch_assigned: bool = False
    broken: str = ""
    writing_us: int = 0  # how long the script waits for the main loop when it writes the mixer

    def __post_init__(self) -> None:
        prefix = "Q_" if self.kind == PLANE else ""
        self.parameters = {
            f"{prefix}FRAME_CLASS": SCRIPTING_MIXER,
            f"{prefix}FRAME_TYPE": 1,
            "MAV_SYSID": 1,
            "DOBC_FRAME": 1,
            "DOBC_ENABLE": 1,
        } | self.parameters
        self.factors: dict[str, dict[int, float]] = {}
        self.test_order: dict[int, int] = {}
        self.motors = 0
        self.texts: list[str] = []
        self.refusal: str | None = "nothing heard from the script"
        self.answers: list[Answer] = []
        self._inbox: list[bytes] = []
        self._lua = LuaRuntime(encoding="latin-1", unpack_returned_tuples=True)
        self._update = None
        self._start()

    # The script -----------------------------------------------------------------------------------------------

    def _start(self) -> None:
        lua = self._lua
        env = lua.table()
        for name in SANDBOX:
            env[name] = lua.globals()[name]
        for name, value in self._bindings().items():
            env[name] = value
        strict = lua.eval(
            "function(env) return setmetatable({}, {"
            "__index = function(_, k) local v = env[k]; if v == nil then error('no ' .. k, 2) end; return v end,"
            "__newindex = function(_, k) error('global ' .. k, 2) end}) end"
        )
        load = lua.eval("function(text, env) return assert(load(text, 'dob_correction.lua', 't', env)) end")
        chunk = load(SCRIPT.read_text(encoding="latin-1"), strict(env))
        self._update, self._period_ms = chunk()

    def run(self, seconds: float, step_us: int = 4000) -> None:
        """Let the vehicle's time pass, the script called every `step_us`."""
        for _ in range(max(1, round(seconds * 1e6 / step_us)) if step_us else 1):
            self.now_us += step_us
            self._update, self._period_ms = self._update()

    def end(self) -> None:
        """What ArduPilot does to a script that has exceeded its time: its function is dropped and garbage collected."""
        self._update = None
        self._lua.eval("collectgarbage()")
        self._lua.eval("collectgarbage()")

    def __del__(self) -> None:
        self.end()  # while what the script calls is still there

    # What a companion does ------------------------------------------------------------------------------------

    def hear(
        self, x: float, y: float = 0.0, z: float = 0.0, *, stamp_us: int | None = None, age_us: int = 4000,
        system: int = 1, component: int = 191, name: bytes = b"DOB_CORR",
    ) -> int:  # fmt: skip
        """A DEBUG_VECT comes in, as mavlink_message_t: checksum, header, payload. Returns its stamp."""
        stamp_us = self.now_us - age_us if stamp_us is None else stamp_us
        self._comes(250, struct.pack("<Qfff10s", stamp_us, x, y, z, name), system, component)
        return stamp_us

    def greet(self, *, system: int = 1, component: int = 191) -> None:
        """A HEARTBEAT comes in."""
        self._comes(0, struct.pack("<IBBBBB", 0, 18, 8, 0, 4, 3), system, component)

    def _comes(self, number: int, payload: bytes, system: int, component: int) -> None:
        payload = payload.rstrip(b"\0")
        header = struct.pack("<HBBBBBBBI", 0, 0xFD, len(payload), 0, 0, 0, system, component, number)[:-1]
        self._inbox.append((header + payload).ljust(291, b"\0"))

    def converse(self, seconds: float, x: float, y: float = 0.0, z: float = 0.0) -> None:
        """A companion that sends the same correction at 250 Hz."""
        for _ in range(round(seconds * 250)):
            self.hear(x, y, z)
            self.run(0.004)

    # What can be seen from outside ----------------------------------------------------------------------------

    def thrusts(self, moment: tuple[float, float, float] | None = None, throttle: float | None = None) -> np.ndarray:
        """What the mixer makes of throttle and moment with the factors that it holds, motor by motor."""
        throttle = self.throttle if throttle is None else throttle
        names = ("throttle", "roll", "pitch", "yaw")
        asked = (throttle, *(self.moment if moment is None else moment))
        return sum(
            value * np.array([self.factors[name][i] for i in range(self.motors)])
            for name, value in zip(names, asked, strict=True)
        )

    def acting(self) -> np.ndarray:
        """The moment that the motors make (least squares over the frame's own factors), normalized torque."""
        frame = np.array([[self.factors[name][i] for i in range(self.motors)] for name in ("roll", "pitch", "yaw")])
        return np.linalg.lstsq(frame.T, self.thrusts() - self.thrusts().mean(), rcond=None)[0]

    def added(self) -> np.ndarray:
        """The part of it that the rate controller has not asked for."""
        return self.acting() - np.array(self.moment)

    # Bindings -------------------------------------------------------------------------------------------------

    def _bindings(self) -> dict[str, object]:
        return {
            "FWVersion": self._singleton(type=lambda: self.kind),
            "gcs": self._singleton(send_text=lambda _severity, text: self.texts.append(text)),
            "micros": lambda: self._uint32(self.now_us),
            "millis": lambda: self._uint32(self.now_us // 1000),
            "param": self._singleton(
                get=self.parameters.get, add_table=lambda _key, _prefix, _size: True, add_param=self._add_param
            ),
            "Parameter": lambda name: self._singleton(get=lambda: float(self.parameters[name])),
            "motor_factor_table": self._factor_table,
            "Motors_dynamic": self._singleton(
                add_motor=self.test_order.__setitem__, load_factors=self._load_factors, init=self._init_motors
            ),
            "motors": self._singleton(
                set_frame_string=lambda _text: None,
                get_spool_state=lambda: self.spool_state,
                get_throttle=lambda: self._or_error("get_throttle", self.throttle),
                get_roll=lambda: self.moment[0],
                get_pitch=lambda: self.moment[1],
                get_yaw=lambda: self.moment[2],
                get_roll_ff=lambda: 0.0,
                get_pitch_ff=lambda: 0.0,
                get_yaw_ff=lambda: 0.0,
            ),
            "vehicle": self._singleton(get_likely_flying=lambda: self.flying),
            "quadplane": self._singleton(in_vtol_mode=lambda: self.vtol, in_assisted_flight=lambda: False),
            "ahrs": self._singleton(get_pitch_rad=lambda: self.pitch),
            "arming": self._singleton(
                is_armed=lambda: self.armed,
                get_aux_auth_id=lambda: 0,
                set_aux_auth_passed=lambda _id: setattr(self, "refusal", None),
                set_aux_auth_failed=lambda _id, why: setattr(self, "refusal", why),
            ),
            "rc": self._singleton(
                get_aux_cached=lambda _function: self.switch,
                find_channel_for_option=lambda _function: 7 if self.switch_assigned else None,
            ),
            "mavlink": self._singleton(
                init=lambda _queue, _ids: None,
                register_rx_msgid=lambda _number: True,
                receive_chan=lambda: (self._inbox.pop(0).decode("latin-1"), 2) if self._inbox else None,
                send_chan=self._sent,
            ),
        }

    def _singleton(self, **functions):
        table = self._lua.table()
        for name, function in functions.items():
            table[name] = lambda _self, *arguments, function=function: function(*arguments)
        return table

    def _uint32(self, value: int):
        value &= 0xFFFFFFFF
        return self._singleton(toint=lambda: value, tofloat=lambda: float(np.float32(value)))

    def _factor_table(self):
        rows = {name: {} for name in ("roll", "pitch", "yaw", "throttle")}
        table = self._singleton(**{name: row.__setitem__ for name, row in rows.items()})
        table["rows"] = lambda: rows
        return table

    def _load_factors(self, table) -> None:
        self.now_us += self.writing_us
        self.factors = {name: dict(row) for name, row in table["rows"]().items()}

    def _init_motors(self, expected: int) -> bool:
        self.motors = expected
        return len(self.test_order) == expected

    def _add_param(self, _key: int, _index: int, name: str, default: float) -> bool:
        self.parameters.setdefault(f"DOBC_{name}", default)
        return True

    def _or_error(self, name: str, value: float) -> float:
        if self.broken == name:
            raise LuaError(f"{name} broke")
        return value

    def _sent(self, channel: int, number: int, payload: str) -> bool:
        stamp, *controls, group = struct.unpack("<Q8fB", payload.encode("latin-1"))
        assert (channel, number, group) == (2, 140, 0)
        assert all(map(math.isfinite, controls))
        self.answers.append(Answer(stamp, tuple(controls[:3]), controls[3], tuple(controls[4:7]), controls[7]))
        return True
