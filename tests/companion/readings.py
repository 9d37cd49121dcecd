"""ArduCopter's simulated quadrotor about roll, whose script reads the moment and adds corrections now and then, and the
observer as it flies: what that leaves of a design's attenuation, and of its correction at 18 to 45 Hz.

    python -m tests.companion.readings [SECONDS]

The simulator runs 5 or 5.8 ms at once (`min_sleep_time` in ArduPilot's source). The script then adds the newest
correction and reads what the rate controller puts out; both reach the companion after the next such piece. The
disturbance is that of tests.ardupilot.programs, noise-roll. Losses are of single messages, either way.
"""

import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.signal import butter, sosfilt

from dob_companion.artifact import DobDesign
from dob_companion.companion.samples import AHEAD, Arrival, Samples, revisable
from dob_companion.lti.filters import butterworth
from dob_companion.observer import GyroModel, ObserverBank, missing_samples
from dob_companion.synthesis.tune.tuning import tuned_design_from_toml
from tests.ardupilot.programs import PROGRAMS, UPDATE_S, signal

EXAMPLE = Path(__file__).parents[2] / "examples" / "ardupilot_copter.toml"
STEP_S, LOOP, PIECES = 1.0 / 1200.0, 3, (6, 7)
"""The simulator's step, steps of a main loop, and steps that it runs at once."""
SAMPLE_S, LATE_US = 0.004, 1250
GAIN, SLOW, FILTER = 299.0, 2.05, butterworth(STEP_S, 20.0)
PROPORTIONAL, INTEGRAL, DERIVATIVE, DERIVATIVE_HZ, ANGLE = 0.135, 0.135, 0.0036, 20.0, 4.5
GYRO_NOISE, LIMIT, SKIPPED_S, FADE_S = 3e-4, 0.2, 8.0, 0.5
FAST_HZ = (18.0, 45.0)
BEGIN_US = 1_000_000


class Companion:
    """The grid, the observer and the gyro's model of a daemon, about roll; no supervisor."""

    def __init__(self, design: DobDesign) -> None:
        missing = missing_samples(design)
        self._model = GyroModel(design, longest=AHEAD, revisable=revisable(missing))
        self._bank = ObserverBank(design, revisable=revisable(missing))
        self._samples = Samples(design.dt, missing, self._model)

    def gyro(self, stamp_us: int, rate: float) -> float:
        """The estimate that answers a sample; 0 after a gap."""
        arrived = self._samples.gyro(stamp_us, (rate, 0.0, 0.0))
        if arrived.arrival is Arrival.GAP:
            self._bank.reset()
            self._model.reset()
            return 0.0
        for inputs in arrived.finished:
            self._bank.advance(*inputs)
        estimate = self._bank.estimate(arrived.rates)[0]
        for inputs in arrived.finished:
            self._model.advance(*inputs)
        return estimate

    def moment(self, stamp_us: int, moment: float, ours: float) -> None:
        """A report of the script."""
        revisions = self._samples.moment(stamp_us, (moment, 0.0, 0.0), (ours, 0.0, 0.0), LATE_US)
        for revision in revisions or ():
            self._bank.revise(*revision)
            self._model.revise(*revision)


@dataclass
class Roll:
    """Plant, gyro filter and ArduPilot's controllers."""

    rate: float = 0.0
    angle: float = 0.0
    seen: float = 0.0
    _filter: np.ndarray = field(default_factory=lambda: np.zeros((2, 1)))
    _sum: float = 0.0
    _error: float = 0.0
    _slope: float = 0.0
    _smooth: float = field(default=1.0 - np.exp(-2.0 * np.pi * DERIVATIVE_HZ * LOOP * STEP_S))

    def controller(self) -> float:
        """One main loop."""
        error, dt = -ANGLE * self.angle - self.seen, LOOP * STEP_S
        self._sum += INTEGRAL * error * dt
        self._slope += self._smooth * ((error - self._error) / dt - self._slope)
        self._error = error
        return PROPORTIONAL * error + self._sum + DERIVATIVE * self._slope

    def step(self, moment: float, acceleration: float) -> None:
        """One step of the simulator, rad/s² from outside."""
        self.rate += STEP_S * (GAIN * moment + acceleration - SLOW * self.rate)
        self.angle += STEP_S * self.rate
        self.seen = float((FILTER.C @ self._filter + FILTER.D * self.rate).item())
        self._filter = FILTER.A @ self._filter + FILTER.B * self.rate


@dataclass(frozen=True)
class Flown:
    """RMS of the attitude, deg, and of the correction's part at FAST_HZ, the largest of that in 0.25 s."""

    attitude: float
    fast: float
    fastest: float


def fly(design: DobDesign | None, seconds: float, loss: float = 0.0, seed: int = 8) -> Flown:
    """`design` None: without observer."""
    rng, wind = np.random.default_rng(seed), signal(PROGRAMS["noise-roll"], seconds)
    roll, companion = Roll(), Companion(design) if design else None
    steps = int(seconds / STEP_S)
    angles, corrections = np.zeros(steps), np.zeros(steps)
    own = added = next_sample = 0.0
    samples: list[tuple[int, float]] = []
    answers: list[float] = []
    report: tuple[int, float, float] | None = None
    left = PIECES[0]
    for step in range(steps):
        now = step * STEP_S
        if step % LOOP == 0:
            own = roll.controller()
            if now >= next_sample - 1e-9:
                next_sample += SAMPLE_S
                samples.append((BEGIN_US + round(1e6 * now), roll.seen + GYRO_NOISE * rng.standard_normal()))
        roll.step(own + added, wind[int(now / UPDATE_S)])
        angles[step], corrections[step] = roll.angle, added
        left -= 1
        if left or companion is None:
            continue
        left = int(rng.choice(PIECES))
        heard = [answer for answer in answers if rng.random() >= loss]
        added = float(np.clip(heard[-1], -LIMIT, LIMIT)) if heard else added
        if report is not None and rng.random() >= loss:
            companion.moment(*report)
        report = BEGIN_US + round(1e6 * (now + STEP_S)), own + added, added
        share = min(1.0, now / FADE_S)
        answers = [-share * companion.gyro(*sample) for sample in samples if rng.random() >= loss]
        samples = []
    skipped, window = int(SKIPPED_S / STEP_S), int(0.25 / STEP_S)
    fast = sosfilt(butter(4, FAST_HZ, "band", fs=1.0 / STEP_S, output="sos"), corrections[skipped:])
    windows = fast[: len(fast) // window * window].reshape(-1, window)
    return Flown(float(np.degrees(angles[skipped:].std())), float(fast.std()), float(windows.std(axis=1).max()))


def designed(replaced: str = "", by: str = "") -> DobDesign:
    """Roll of the example, with one line of it changed."""
    text = EXAMPLE.read_text(encoding="utf-8").partition('[[block]]\nname = "pitch"')[0]
    assert replaced in text
    return tuned_design_from_toml(text.replace(replaced, by), "roll.toml")[0]


def main() -> None:
    """Print a table."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 100.0
    designs = {"moment_rate_hz = 180": designed(), "without it": designed("moment_rate_hz = 180", "")}
    off = fly(None, seconds).attitude
    print("| design | certified | lost | off/on | correction at 18 to 45 Hz, RMS, worst 0.25 s |")
    print("| --- | --: | --: | --: | --: |")
    for name, design in designs.items():
        for loss in (0.0, 0.01, 0.03):
            found = fly(design, seconds, loss)
            promised = design.blocks[0].certificate.extra["attenuation"]
            print(
                f"| {name} | {promised:.1f} | {loss:.0%} | {off / found.attitude:.1f} | {found.fast:.4f}, "
                f"{found.fastest:.3f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
