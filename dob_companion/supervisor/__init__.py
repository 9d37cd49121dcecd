"""Safe or unsafe: the state table, the conditions that move it, and the fades that it commands. Pure."""

from dob_companion.supervisor.fade import CorrectionShaper
from dob_companion.supervisor.monitors import DelayMonitor, Hysteresis, LinkGate, RateMonitor
from dob_companion.supervisor.table import Conditions, State, Supervisor, Transition

__all__ = [
    "Conditions",
    "CorrectionShaper",
    "DelayMonitor",
    "Hysteresis",
    "LinkGate",
    "RateMonitor",
    "State",
    "Supervisor",
    "Transition",
]
