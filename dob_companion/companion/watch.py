"""What is watched beside the samples: the aircraft, the axes, the plant, and our own correction coming back."""

from dob_companion.artifact import DobDesign
from dob_companion.companion.samples import Inputs
from dob_companion.mavlink import AppliedMoment, Landed
from dob_companion.mavlink.facts import Axes3
from dob_companion.supervisor import (
    Air,
    AxisCheck,
    Echo,
    EstimateBounds,
    FlightRegime,
    Innovation,
    RegimeLimits,
    Saturation,
)

AIR = {
    Landed.UNKNOWN: Air.UNKNOWN,
    Landed.ON_GROUND: Air.ON_GROUND,
    Landed.IN_AIR: Air.IN_AIR,
    Landed.TAKING_OFF: Air.CHANGING,
    Landed.LANDING: Air.CHANGING,
}


class Watch:
    """Collects facts about aircraft and loop; says what speaks against injecting, and what is a fault.

    The work of the axis check and the whiteness test is done when a sample's moment comes in, that is after its answer
    has left.
    """

    def __init__(self, design: DobDesign, limits: RegimeLimits) -> None:
        self.regime = FlightRegime(limits)
        self.axes = AxisCheck(design)
        self.bounds = EstimateBounds(design.dt)
        self.echo = Echo(design.dt)
        self.model_why = self.growing = ""
        self._innovation = Innovation(design.dt)
        self._saturation = Saturation(design.dt)
        self._due: list[tuple[Inputs, Axes3]] = []

    def finished(self, inputs: Inputs, innovation: Axes3) -> None:
        """A finished grid interval and what was not foreseen of it, to be looked at when there is time."""
        self._due.append((inputs, innovation))

    def applied(self, moment: AppliedMoment) -> str:
        """A moment that was taken in. Returns a fault in words, or ""; `growing` then is up to date."""
        self.regime.throttle(moment.thrust)
        self._saturation.add(moment.moment)
        injected = any(moment.correction)
        self.growing = ""
        for inputs, innovation in self._due:
            self.growing = self._innovation.add(innovation, inputs[1], moment.correction) or self.growing
            if not injected:  # the check is about the controller's own moment
                self.axes.add(*inputs)
            else:
                self.axes.interrupt()
        self._due.clear()
        foreign = self.echo.foreign(moment.stamp_us, moment.age_samples, moment.moment, moment.correction)
        return "corrections come back changed" if foreign else ""

    def judge(self, injecting: bool) -> str:
        """The slower judgements, several times a second. Returns the axis that rings, in words, or ""."""
        errors = self.axes.errors()
        self.model_why = errors[0] if errors else ("moment at its stops" if self._saturation.excessive else "")
        return self._innovation.why_not() if injecting else ""

    def start_anew(self) -> None:
        """The samples start anew after a gap."""
        self._due.clear()
        self.bounds.clear()
        self.axes.interrupt()
        self._innovation.clear()
        self.growing = ""
