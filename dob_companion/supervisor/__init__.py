"""Safe or unsafe: the state table, the conditions that move it, and the fades that it commands. Pure."""

from dob_companion.supervisor.axes import AxisCheck
from dob_companion.supervisor.fade import CorrectionShaper
from dob_companion.supervisor.health import Echo, EstimateBounds, Saturation
from dob_companion.supervisor.monitors import DelayMonitor, Hysteresis, LinkGate, RateMonitor, RoundTrip, percentile
from dob_companion.supervisor.regime import Air, FlightRegime, RegimeLimits
from dob_companion.supervisor.ringing import Innovation
from dob_companion.supervisor.steps import FirstEnabling, Steps
from dob_companion.supervisor.table import Conditions, State, Supervisor, Transition
from dob_companion.supervisor.takeup import TakeUp

__all__ = [
    "Air",
    "AxisCheck",
    "Conditions",
    "CorrectionShaper",
    "DelayMonitor",
    "Echo",
    "EstimateBounds",
    "FirstEnabling",
    "FlightRegime",
    "Hysteresis",
    "Innovation",
    "LinkGate",
    "RateMonitor",
    "RegimeLimits",
    "RoundTrip",
    "Saturation",
    "State",
    "Steps",
    "Supervisor",
    "TakeUp",
    "Transition",
    "percentile",
]
