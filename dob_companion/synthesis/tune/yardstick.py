"""What a pilot would measure of an observer, fast enough to be asked of hundreds: the yardstick of `tuning.py`.

With an exact model a command-invariant observer leaves d - z^-tau d_hat = (1 - z^-tau Q) d =: T_f d of the disturbance
(the paper's eq. 2), whatever the controller. So everything follows from T_f and the baseline loop, closed once::

    theta = F T_f d           F = d -> attitude, rate and attitude loop closed, observer off
    u_e + d = S T_f d         S = 1 / (1 + C G): the sensitivity whose disk margin counts
    d_hat = Q d + D_y n

Further delay of delta samples that the vehicle does not report leaves u_e wrong and closes a loop of its own around
the observer, det(I + X e^(-j w delta)) = 0 with X = z^-tau Q (I - z^-tau Q)^-1: the delay margin is the least delay
that turns an eigenvalue of X of magnitude 1 to -1.

It is the nominal loop; the certificate measures the chosen observer again, from its matrices.
"""

from dataclasses import dataclass, replace
from typing import Any

import control as ct
import numpy as np
from numpy.typing import NDArray

from dob_companion.artifact import Certificate
from dob_companion.errors import NotCertifiedError, UnsolvableError
from dob_companion.lti.gramian import gramian
from dob_companion.lti.margins import MOST_DELAY_SAMPLES
from dob_companion.lti.response import response, spectral_radius
from dob_companion.synthesis.norms.structured import structured_bounds
from dob_companion.synthesis.optimal.problem import Spectrum
from dob_companion.synthesis.plant.models import stack
from dob_companion.synthesis.spec.auto import AutoSpec

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

MARGIN_POINTS, SPECTRUM_POINTS = 160, 300
"""Frequencies, logarithmic and as many again linear, at which margins are looked for, and those over which spectra are
integrated."""


@dataclass(frozen=True, slots=True)
class Measured:
    """An observer by the yardstick.

    attenuation   RMS of the attitude error off / on, for disturbances of [auto]'s spectrum
    disk_margin   of the rate loop with the observer, all moments at once
    noise         RMS of the correction that gyro noise alone causes, normalized torque, the worst axis
    slowest_s     time constant of the observer's slowest mode, s
    delay_margin  further samples of delay that the vehicle does not report and the loop survives; a certificate counts
                  whole ones
    at_gains      attenuation where the plant's gain is other than modelled, at [auto]'s gains
    """

    attenuation: float
    disk_margin: float
    noise: float
    slowest_s: float
    delay_margin: float
    at_gains: tuple[float, ...] = ()


def as_certified(found: Measured | None, proof: Certificate) -> Measured:
    """What was measured of a designed block, and its certificate's word where that knows better: of the delay margin
    it counts whole samples. Raises NotCertifiedError for an observer that the yardstick calls unstable."""
    if found is None:
        raise NotCertifiedError("the certified observer is unstable by the yardstick")
    least = proof.delay_margin_samples
    return replace(
        found,
        disk_margin=proof.disk_margin,
        slowest_s=proof.slowest_mode_s,
        delay_margin=float(np.clip(found.delay_margin, least, least + 0.999)),
    )


class Yardstick:
    """The baseline loop of one block with its link, and the weather it flies in."""

    def __init__(self, plant: Any, controller: Any, delays: tuple[int, ...], auto: AutoSpec) -> None:
        """Raise UnsolvableError when the attitude loop is unstable with the observer off."""
        self.dt, self.noise_rms = float(plant.dt), auto.noise_rms
        self._delays, self._rates = np.array(delays), plant.D.shape[0]
        self._require_stable(plant, controller, auto.attitude_gain)
        self._band = np.geomspace(2.0 * np.pi * auto.low_hz * self.dt / 30.0, np.pi, SPECTRUM_POINTS + 1)[:-1]
        spectrum = Spectrum(auto.spectrum).amplitude(self._band, self.dt)[:, None, None]
        self._wide = np.unique(
            np.concatenate([np.geomspace(1e-3, np.pi, MARGIN_POINTS), np.linspace(0.01, np.pi, MARGIN_POINTS)])
        )
        one = np.eye(plant.D.shape[1])
        G, C = response(plant, self._band), response(controller, self._band)
        z = np.exp(1j * self._band)[:, None, None]
        integral = self.dt / 2.0 * (z + 1.0) / (z - 1.0)  # trapezoidal: the rate's mean over the sample
        self._to_attitude = spectrum * integral * G @ np.linalg.inv(one + C @ G * (1.0 + auto.attitude_gain * integral))
        self._off = self._rms(self._to_attitude)
        around = response(controller, self._wide) @ response(plant, self._wide)
        self._sensitivity: ComplexArray = np.linalg.inv(one + around).astype(complex)
        self.disk_margin_off = 1.0 / self._largest(np.asarray(self._sensitivity - 0.5 * one))

    def measure(self, observer: Any) -> Measured | None:
        """None for an unstable observer; `observer` is D(z) with inputs [y_n; u_e] and no direct path from u_e."""
        radius = spectral_radius(observer.A)
        if radius >= 1.0:
            return None
        on = self._rms(self._to_attitude @ self._left(observer, self._band))
        left, one = self._left(observer, self._wide), np.eye(len(self._delays))
        return Measured(
            attenuation=self._off / on,
            disk_margin=1.0 / self._largest(np.asarray(self._sensitivity @ left - 0.5 * one)),
            noise=self.noise_rms * self._noise_gain(observer),
            slowest_s=-self.dt / float(np.log(radius)) if radius > 0.0 else 0.0,
            delay_margin=self._delay_margin(np.asarray((one - left) @ np.linalg.inv(left))),
        )

    def _left(self, observer: Any, angles: Array) -> ComplexArray:
        """T_f = I - z^-tau Q, Q = -D_u."""
        D_u = response(observer, angles)[:, :, self._rates :]
        late = np.exp(-1j * np.outer(angles, self._delays))[:, :, None]
        return np.asarray(np.eye(len(self._delays)) + late * D_u)

    def _delay_margin(self, X: ComplexArray) -> float:
        """Least delay in samples that turns an eigenvalue of magnitude 1 to -1; MOST_DELAY_SAMPLES when none does."""
        values = np.linalg.eigvals(X)
        order = np.argsort(-np.abs(values), axis=1)
        values = np.take_along_axis(values, order, axis=1)
        logs = np.log(np.maximum(np.abs(values), 1e-300))  # an observer of nothing has X = 0
        least = float(MOST_DELAY_SAMPLES)
        for k, i in zip(*np.nonzero(np.diff(np.sign(logs), axis=0)), strict=True):
            share = logs[k, i] / (logs[k, i] - logs[k + 1, i])
            angle = self._wide[k] + share * (self._wide[k + 1] - self._wide[k])
            turn = np.angle(values[k, i]) + share * np.angle(values[k + 1, i] / values[k, i])
            least = min(least, float((turn + np.pi) % (2.0 * np.pi) / angle))
        return least

    def _noise_gain(self, observer: Any) -> float:
        """RMS of n -> d_hat per unit of white noise on every rate, the worst output."""
        K, K_z = observer.B[:, : self._rates], observer.D[:, : self._rates]
        power = observer.C @ gramian(observer.A, K) @ observer.C.T + K_z @ K_z.T
        return float(np.sqrt(np.max(np.diag(power))))

    def _rms(self, G: ComplexArray) -> float:
        return float(np.linalg.norm(G))

    def _largest(self, M: ComplexArray) -> float:
        """Largest structured singular value over frequency (of coupled axes its upper bound)."""
        return float(np.max(structured_bounds(M)[0]))

    def _require_stable(self, plant: Any, controller: Any, attitude_gain: float) -> None:
        step, count = self.dt * attitude_gain, self._rates
        proportional_integral = stack([ct.ss([[1.0]], [[1.0]], [[step]], [[1.0 + step / 2.0]], plant.dt)] * count)
        loop = ct.feedback(plant, controller * proportional_integral if attitude_gain else controller)
        if spectral_radius(loop.A) >= 1.0:
            raise UnsolvableError(
                f"the attitude loop ({attitude_gain:g} 1/s) is unstable with the observer off; "
                "state the vehicle's own as attitude_gain in [auto]"
            )
