"""The vehicle's own parameters and their protocol; all REAL32, so that every ground station reads them alike."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from math import isfinite

from pymavlink.dialects.v20 import common as mavlink

from sitl.autopilot.vehicle import Vehicle
from sitl.constants import AXES, DT, DT_US
from sitl.wire.port import COMPONENT, SYSTEM, Message, Port, source_of


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter: how to read it, the range of a write, and how to write it (None: read-only)."""

    name: str
    read: Callable[[], float]
    low: float = 0.0
    high: float = 0.0
    write: Callable[[float], None] | None = None


class Parameters:
    """Parameter table of one vehicle. `takeoff_altitude` (m) is what a take-off without an altitude climbs to.

    `SIM_ATT_P` is the attitude gain of roll, 1/s; a write sets all three axes. `SIM_ROLLRATE_P`, `_I` and `_D` (and
    PITCHRATE, YAWRATE) are the rate controller's: u = P e + I dt sum(e before) + D (e − e before) / dt. A vehicle whose
    controllers are matrices has none of these.
    `MIS_TAKEOFF_ALT` has the name that MAVSDK asks for; `SYSID_THISMAV` the one that MAVProxy looks for.
    """

    def __init__(self, vehicle: Vehicle, takeoff_altitude: float, seed: int) -> None:
        self.takeoff_altitude = takeoff_altitude
        rows = (
            Parameter("MIS_TAKEOFF_ALT", lambda: self.takeoff_altitude, 1.0, 100.0, self._set_takeoff_altitude),
            Parameter("SIM_ATT_P", lambda: vehicle.attitude_gain[0], 0.5, 12.0, lambda v: _set_gain(vehicle, v)),
            Parameter("SIM_RATE_HZ", lambda: 1e6 / DT_US),
            Parameter("SIM_SEED", lambda: float(seed)),
            Parameter("SYSID_THISMAV", lambda: float(SYSTEM)),
            *_rate_gains(vehicle),
        )
        self._rows = {row.name: row for row in rows}
        self._names = list(self._rows)

    def _set_takeoff_altitude(self, value: float) -> None:
        self.takeoff_altitude = value

    def receive(self, message: Message, port: Port) -> None:
        """Answer one PARAM_* message on `port`; whoever is addressed by 0 stays silent on names it does not know."""
        kind = message.get_type()
        if kind == "PARAM_REQUEST_LIST":
            for name in self._names:
                port.send(self._value(name))
        elif kind == "PARAM_REQUEST_READ":
            self._read(message, port)
        elif kind == "PARAM_SET":
            self._set(message, port)

    def _read(self, message: Message, port: Port) -> None:
        index = message.param_index
        if index < 0:
            name = _text(message.param_id)
        elif index < len(self._names):
            name = self._names[index]
        else:
            self._refuse(message, port, "", index, mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST)
            return
        if name in self._rows:
            port.send(self._value(name))
        else:
            self._refuse(message, port, name, -1, mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST)

    def _set(self, message: Message, port: Port) -> None:
        name, value = _text(message.param_id), message.param_value
        row = self._rows.get(name)
        if row is None:
            self._refuse(message, port, name, -1, mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST)
            return
        if row.write is None:
            self._refuse(message, port, name, -1, mavlink.MAV_PARAM_ERROR_READ_ONLY)
        elif not isfinite(value) or not row.low <= value <= row.high:
            self._refuse(message, port, name, -1, mavlink.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE)
        else:
            row.write(value)
        port.send(self._value(name))

    def _value(self, name: str) -> Message:
        return mavlink.MAVLink_param_value_message(
            name.encode(),
            self._rows[name].read(),
            mavlink.MAV_PARAM_TYPE_REAL32,
            len(self._names),
            self._names.index(name),
        )

    @staticmethod
    def _refuse(message: Message, port: Port, name: str, index: int, error: int) -> None:
        if message.target_component == COMPONENT:
            port.send(mavlink.MAVLink_param_error_message(*source_of(message), name.encode(), index, error))


def _rate_gains(vehicle: Vehicle) -> Iterator[Parameter]:
    for axis, gains in zip(AXES, vehicle.rate_gains or (), strict=False):
        for name, value in zip("PID", gains.pid(DT), strict=True):
            yield Parameter(f"SIM_{axis.upper()}RATE_{name}", partial(float, value))


def _set_gain(vehicle: Vehicle, value: float) -> None:
    vehicle.attitude_gain = (value, value, value)


def _text(field: str | bytes) -> str:
    return field.decode("ascii", "replace") if isinstance(field, bytes) else field
