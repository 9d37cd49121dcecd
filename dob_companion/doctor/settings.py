"""What an autopilot's own settings mean for flying with a companion (docs/ardupilot.md, docs/px4.md). Pure."""

from collections.abc import Iterator, Mapping

from dob_companion.doctor.finding import Finding, Verdict
from dob_companion.mavlink import makes

_ARDUPILOT = (
    "INS_GYRO_FILTER",
    "SCHED_LOOP_RATE",
    "SCR_ENABLE",
    "FRAME_CLASS",
    "Q_FRAME_CLASS",
    "DOBC_ENABLE",
    "DOBC_FRAME",
    "DOBC_RATE",
)
_PX4 = (
    "IMU_GYRO_CUTOFF",
    "IMU_DGYRO_CUTOFF",
    "IMU_GYRO_RATEMAX",
    "IMU_INTEG_RATE",
    "MC_BAT_SCALE_EN",
    "CA_AIRFRAME",
    "DOBC_EN",
)
SLOWEST_LOOP_HZ = 400.0
SCRIPTING_FRAME = 17.0
"""FRAME_CLASS of the dynamic scripting matrix."""

_SCRIPT, _MODULE, _FILTERS, _LOOP = "script", "module", "filters", "rate loop"


def wanted(make: str, vehicle: str) -> tuple[str, ...]:  # noqa: ARG001
    """Which parameters `doctor` reads of an autopilot of this make; each vehicle of a make has the same."""
    return {makes.ARDUPILOT: _ARDUPILOT, makes.PX4: _PX4}.get(make, ())


def settings(make: str, told: Mapping[str, float], rate_hz: float) -> Iterator[Finding]:
    """Findings from the parameters that were told, for a design of this rate."""
    if not wanted(make, ""):
        return
    if not told:
        text = "parameters are not told: filters and script are not known"
        yield Finding(Verdict.NOTE, _FILTERS, text, "let PARAM_REQUEST_READ of 191 through; is signing on?")
    elif make == makes.ARDUPILOT:
        yield from _filters(told, ("INS_GYRO_FILTER",), "it belongs to the plant")
        yield from _ardupilot_loop(told)
        yield from _script(told, rate_hz)
    else:
        yield from _filters(told, ("IMU_GYRO_CUTOFF", "IMU_DGYRO_CUTOFF"), "in the controller")
        yield from _px4_loop(told, rate_hz)
        yield from _module(told)


def _filters(told: Mapping[str, float], names: tuple[str, ...], where: str) -> Iterator[Finding]:
    said = ", ".join(f"{name} {told[name]:g} Hz" for name in names if name in told)
    if said:
        yield Finding(Verdict.OK, _FILTERS, f"{said}: {where} of a design")


def _ardupilot_loop(told: Mapping[str, float]) -> Iterator[Finding]:
    hz = told.get("SCHED_LOOP_RATE")
    if hz is not None:
        slow = hz < SLOWEST_LOOP_HZ
        remedy = f"SCHED_LOOP_RATE {SLOWEST_LOOP_HZ:g}, reboot" if slow else ""
        yield Finding(Verdict.NOTE if slow else Verdict.OK, _LOOP, f"SCHED_LOOP_RATE {hz:g} Hz", remedy)


def _script(told: Mapping[str, float], rate_hz: float) -> Iterator[Finding]:
    """The first thing that keeps the script from adding corrections, in the order in which it is set up."""
    frame = next((name for name in ("FRAME_CLASS", "Q_FRAME_CLASS") if name in told), "FRAME_CLASS")
    own = told.get(frame, SCRIPTING_FRAME)
    if not told.get("SCR_ENABLE"):
        yield Finding(Verdict.MISSING, _SCRIPT, "scripting is off, SCR_ENABLE 0", "SCR_ENABLE 1, reboot")
    elif "DOBC_ENABLE" not in told:
        text, remedy = "no DOBC_ENABLE: the script does not run", "dob_correction.lua to APM/scripts, reboot"
        yield Finding(Verdict.MISSING, _SCRIPT, text, remedy)
    elif own != SCRIPTING_FRAME:
        text, remedy = f"{frame} {own:g}: the stock mixer flies", f"DOBC_FRAME {own:g}, {frame} 17, reboot"
        yield Finding(Verdict.MISSING, _SCRIPT, text, remedy)
    elif not told.get("DOBC_FRAME"):
        text, remedy = "DOBC_FRAME 0: no airframe, refuses arming", "DOBC_FRAME 1 quad, 2 hexa, 3 octa; reboot"
        yield Finding(Verdict.MISSING, _SCRIPT, text, remedy)
    elif not told["DOBC_ENABLE"]:
        text = "DOBC_ENABLE 0: runs, adds nothing"
        yield Finding(Verdict.NOTE, _SCRIPT, text, "DOBC_ENABLE 1 lets corrections in")
    else:
        yield Finding(Verdict.OK, _SCRIPT, f"DOBC_ENABLE 1, DOBC_FRAME {told['DOBC_FRAME']:g}")
    rate = told.get("DOBC_RATE", rate_hz)
    if abs(rate - rate_hz) > 0.5:
        text = f"DOBC_RATE {rate:g}: reports ages in samples of that rate"
        yield Finding(Verdict.MISSING, _SCRIPT, text, f"DOBC_RATE {rate_hz:g}")


def _px4_loop(told: Mapping[str, float], rate_hz: float) -> Iterator[Finding]:
    if "IMU_GYRO_RATEMAX" in told:
        yield Finding(Verdict.OK, _LOOP, f"IMU_GYRO_RATEMAX {told['IMU_GYRO_RATEMAX']:g} Hz")
    stream = told.get("IMU_INTEG_RATE")
    if stream is not None and stream < rate_hz:
        text = f"IMU_INTEG_RATE {stream:g}: HIGHRES_IMU comes no faster"
        yield Finding(Verdict.MISSING, _LOOP, text, f"IMU_INTEG_RATE {rate_hz:g}")
    if told.get("MC_BAT_SCALE_EN"):
        text = "MC_BAT_SCALE_EN 1: gains change with the battery"
        yield Finding(Verdict.NOTE, _LOOP, text, "MC_BAT_SCALE_EN 0")


def _module(told: Mapping[str, float]) -> Iterator[Finding]:
    airframe = told.get("CA_AIRFRAME", 0.0)
    if "DOBC_EN" not in told:
        text, remedy = "no DOBC_EN: stock firmware", "build PX4 with deploy/px4 (docs/px4.md)"
        yield Finding(Verdict.MISSING, _MODULE, text, remedy)
    elif airframe:
        text = f"CA_AIRFRAME {airframe:g}: no multirotor, the module stands aside"
        yield Finding(Verdict.MISSING, _MODULE, text, "fly it without the companion")
    elif not told["DOBC_EN"]:
        yield Finding(Verdict.MISSING, _MODULE, "DOBC_EN 0: the module stands aside", "DOBC_EN 1, reboot")
    else:
        yield Finding(Verdict.OK, _MODULE, "DOBC_EN 1")
