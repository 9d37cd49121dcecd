"""Logs as autopilots write them, byte by byte, from what is asked to be in them."""

import struct

import numpy as np

_SIZES = {"B": "B", "b": "b", "h": "h", "H": "H", "i": "i", "I": "I", "f": "f", "d": "d", "q": "q", "Q": "Q", "M": "B"}
_SIZES |= {"n": "4s", "N": "16s", "Z": "64s", "c": "h", "C": "H", "e": "i", "E": "I", "L": "i"}
_TIMES_100 = "cCeE"


class DataFlash:
    """A .bin: declares each kind of message when the first one is written."""

    def __init__(self):
        self._out = bytearray()
        self._kinds = {"FMT": (128, "BBnNZ")}
        self._declare("FMT", 128, "BBnNZ", "Type,Length,Name,Format,Columns")

    def _declare(self, name, number, layout, columns):
        size = 3 + struct.calcsize("<" + "".join(_SIZES[kind] for kind in layout))
        self._raw("FMT", number, size, name.encode(), layout.encode(), columns.encode())

    def declare(self, name, layout, columns):
        number = 129 + len(self._kinds)
        self._kinds[name] = number, layout
        self._declare(name, number, layout, columns)

    def units(self, name, units):
        """UNIT and FMTU of one kind: a letter for each column, words by letter."""
        if "UNIT" not in self._kinds:
            self.declare("UNIT", "QbZ", "TimeUS,Id,Label")
            self.declare("FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds")
        for letter, word in (("s", b"s"), ("k", b"deg/s"), ("E", b"rad/s"), ("-", b"")):
            self._raw("UNIT", 1, ord(letter), word)
        self._raw("FMTU", 1, self._kinds[name][0], units.encode(), b"-" * len(units))

    def write(self, name, *values):
        self._raw(name, *values)

    def _raw(self, name, *values):
        number, layout = self._kinds[name]
        fields = [round(100 * v) if kind in _TIMES_100 else v for kind, v in zip(layout, values, strict=True)]
        packed = struct.pack("<" + "".join(_SIZES[kind] for kind in layout), *fields)
        self._out += bytes((0xA3, 0x95, number)) + packed

    @property
    def data(self):
        return bytes(self._out)


RATE = "TimeUS,RDes,R,ROut,PDes,P,POut,YDes,Y,YOut"
OLD_RATE = "TimeUS,RllDes,Rll,RllOut,PitDes,Pit,PitOut,YawDes,Yaw,YawOut"


def copter(
    times, rates, moment, *, rate_unit=180.0 / np.pi, full=1.0, columns=RATE, imu=True, firmware="ArduCopter V4.6.0"
):
    """A copter's log: RATE with these rates (rad/s) and moments, in the units asked for, and IMU in rad/s."""
    log = DataFlash()
    log.declare("MSG", "QZ", "TimeUS,Message")
    log.declare("PARM", "QNf", "TimeUS,Name,Value")
    log.declare("EV", "QB", "TimeUS,Id")
    log.declare("RATE", "Qfffffffff", columns)
    log.declare("IMU", "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ")
    log.write("MSG", 1000, firmware.encode())
    log.write("PARM", 1000, b"FRAME_CLASS", 1.0)
    log.write("PARM", 1000, b"INS_GYRO_FILTER", 20.0)
    begin = round(1e6 * times[0])
    log.write("EV", begin, 10)
    log.write("EV", begin + 1000, 28)
    for time, rate, torque in zip(times, rates, moment, strict=True):
        micros = round(1e6 * time)
        told = [x for r, u in zip(rate, torque, strict=True) for x in (0.5 * r * rate_unit, r * rate_unit, u * full)]
        log.write("RATE", micros, *told)
        if imu:
            log.write("IMU", micros, 0, *rate, 0.0, 0.0, -9.8)
            log.write("IMU", micros, 1, *(2.0 * np.asarray(rate)), 0.0, 0.0, -9.8)
    return log


def as_text(log):
    """The same log as a .log, through pymavlink's reader."""
    from pymavlink.DFReader import DFReader_binary

    lines = []
    reader = DFReader_binary(log)
    for declared in reader.formats.values():
        lines.append(
            f"FMT, {declared.type}, {declared.len}, {declared.name}, {declared.format}, {','.join(declared.columns)}"
        )
    reader.rewind()
    while (message := reader.recv_msg()) is not None:
        if message.get_type() != "FMT":
            values = (getattr(message, name) for name in message.get_fieldnames())
            lines.append(", ".join([message.get_type(), *map(str, values)]))
    return "\n".join(lines) + "\n"


_ULOG_TYPES = {
    "uint64_t": "Q",
    "float": "f",
    "uint8_t": "B",
    "bool": "?",
    "uint16_t": "H",
    "int32_t": "i",
    "uint32_t": "I",
}


def _message(kind, content):
    return struct.pack("<HB", len(content), ord(kind)) + content


class ULog:
    """A .ulg: definitions, then subscriptions, then data."""

    def __init__(self, start_us=0, flags=None):
        self._defined = bytearray(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", start_us))
        self._subscribed, self._written = bytearray(), bytearray()
        self._topics = {}
        if flags is not None:
            self._defined += _message("B", flags)

    def declare(self, name, fields):
        """`fields`: "uint64_t timestamp;float[3] xyz;" …, without nested ones."""
        self._defined += _message("F", f"{name}:{fields}".encode())
        layout = "<"
        for words in filter(None, fields.split(";")):
            kind, _ = words.split(" ")
            base, _, count = kind.rstrip("]").partition("[")
            layout += _ULOG_TYPES[base] * int(count or 1)
        self._topics[name] = len(self._topics), layout
        self._subscribed += _message("A", struct.pack("<BH", 0, len(self._topics) - 1) + name.encode())

    def setting(self, name, value):
        kind, layout = ("int32_t", "<i") if isinstance(value, int) else ("float", "<f")
        key = f"{kind} {name}".encode()
        message = _message("P", bytes((len(key),)) + key + struct.pack(layout, value))
        if self._written:
            self._written += message
        else:
            self._defined += message

    def write(self, name, *values):
        number, layout = self._topics[name]
        self._written += _message("D", struct.pack("<H", number) + struct.pack(layout, *values))

    def sync(self):
        self._written += _message("S", b"\x2f\x73\x13\x20\x25\x0c\xbb\x12")

    @property
    def data(self):
        return bytes(self._defined + self._subscribed + self._written)


def quad(times, rates, moment, *, old=False, system_type=2, armed=2):
    """A multicopter's log of PX4: both gyros, the torque by the name of this version, attitude, state."""
    log = ULog(round(1e6 * times[0]))
    log.declare("vehicle_angular_velocity", "uint64_t timestamp;uint64_t timestamp_sample;float[3] xyz;")
    log.declare("sensor_combined", "uint64_t timestamp;float[3] gyro_rad;uint32_t gyro_integral_dt;")
    if old:
        log.declare("actuator_controls_0", "uint64_t timestamp;uint64_t timestamp_sample;float[8] control;")
    else:
        log.declare("vehicle_torque_setpoint", "uint64_t timestamp;uint64_t timestamp_sample;float[3] xyz;")
    log.declare("vehicle_attitude", "uint64_t timestamp;float[4] q;")
    log.declare("vehicle_status", "uint64_t timestamp;uint8_t arming_state;uint8_t system_type;uint8_t vehicle_type;")
    log.declare("vehicle_land_detected", "uint64_t timestamp;bool landed;")
    log.setting("IMU_GYRO_CUTOFF", 40.0)
    log.setting("MAV_TYPE", system_type)
    begin = round(1e6 * times[0])
    log.write("vehicle_status", begin, armed, system_type, 1)
    log.write("vehicle_land_detected", begin, False)
    for time, rate, torque in zip(times, rates, moment, strict=True):
        micros = round(1e6 * time)
        log.write("vehicle_angular_velocity", micros + 300, micros, *rate)
        log.write("sensor_combined", micros, *(1.01 * np.asarray(rate)), 4000)
        if old:
            log.write("actuator_controls_0", micros + 500, micros, *torque, 0.4, 0.0, 0.0, 0.0, 0.0)
        else:
            log.write("vehicle_torque_setpoint", micros + 500, micros, *torque)
        log.write("vehicle_attitude", micros, np.cos(0.05), np.sin(0.05), 0.0, 0.0)
    return log


def some_flight(seconds=2.0, rate_hz=250.0, begin=10.0, seed=1):
    """Times, rates and moments that look like a flight's."""
    rng = np.random.default_rng(seed)
    times = begin + np.arange(round(seconds * rate_hz)) / rate_hz
    return times, 0.3 * rng.standard_normal((len(times), 3)), 0.05 * rng.standard_normal((len(times), 3))
