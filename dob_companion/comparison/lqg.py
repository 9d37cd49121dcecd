"""The least attitude error that any correction leaves: control that knows the disturbance's true spectrum (LQG).

What the correction may know: y_n up to sample k - τ and u_e up to k - τ - 1, as every observer here. u_e serves to
remove the moment's own effect, e = y_n - G u_e = G d + n; that it also tells the pilot's command (and, u being
C (r - y_n), the attitude) is left alone: whoever answers that fights the pilot. What it may do with e: everything
causal and linear, which for Gaussian d and n is everything causal. It need not estimate d, it is free of margins, and
may move as much as it likes. So with θ = F (d + c) + F_n n, F and F_n of the loop without observer, sought is

    inf over causal K of the variance of θ, with c = z^-τ K e.

Two routes to the same number:

- `lqg_attitude_bound`, the infimum itself, as a Wiener-Hopf problem (D. C. Youla, J. J. Bongiorno, H. A. Jabr, "Modern
  Wiener-Hopf design of optimal controllers", IEEE Trans. Automatic Control 21, 1976): with F = F_i F_o (inner, outer)
  and the spectrum of e factored, what is lost is what is not causal of F_i* z^τ T.
- `lqg`, a controller: Kalman filter and linear-quadratic regulator by two Riccati equations (B. D. O. Anderson,
  J. B. Moore, "Optimal Control: Linear Quadratic Methods", 1989), the delay as further states, a weight on the
  correction. As the weight vanishes its cost falls to the infimum, which no controller reaches: F is zero at z = -1
  (the attitude adds up means of rates) and at z = 1 (C integrates).
"""

from dataclasses import dataclass
from typing import Any

import control as ct
import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from dob_companion.comparison.flight import NOISE_SIGMA, disturbance_pole
from dob_companion.comparison.rational import roots_of
from dob_companion.comparison.vehicle import OUTPUTS, Vehicle, close, no_observer
from dob_companion.lti.gramian import gramian
from dob_companion.lti.response import response, spectral_radius

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

DECAYS = 64
"""The slowest mode of the loop fades by e to this power within the transform."""


def lqg_attitude_bound(vehicle: Vehicle, scale: float) -> float:
    """RMS attitude error (rad) that no correction undercuts, for a disturbance of sigma `scale` (normalized torque).

    The vehicle's loop must be stable without observer and its controller have no pole outside the unit circle.
    """
    loop = _loop(vehicle)
    count = int(2 ** np.ceil(np.log2(DECAYS / -np.log(spectral_radius(loop.A)))))
    angles = 2.0 * np.pi * (np.arange(count) + 0.5) / count  # half a step aside: the plant may have a pole at z = 1
    z = np.exp(1j * angles)
    a = disturbance_pole(vehicle.dt)
    theta = response(loop, angles)[:, OUTPUTS.index("theta"), :]
    wind = scale * np.sqrt(1.0 - a * a) / (z - a)
    target = theta * np.stack([wind, np.full(count, NOISE_SIGMA)], axis=1)
    M, N = coprime(vehicle.plant, angles)
    seen = np.stack([N * wind, M * NOISE_SIGMA], axis=1)  # M e, of finite power where e itself may wander
    white = seen / _spectral_factor(np.sum(np.abs(seen) ** 2, axis=1))[:, None]
    wanted = z**vehicle.delay * np.conj(_inner(vehicle, z)) * np.sum(target * np.conj(white), axis=1)
    causal = _coefficients(wanted)[: count // 2]
    power = np.mean(np.sum(np.abs(target) ** 2, axis=1)) - np.sum(np.abs(causal) ** 2)
    return float(np.sqrt(power))


@dataclass(frozen=True, slots=True, eq=False)
class Lqg:
    """An LQG controller in its loop: RMS of attitude error (rad) and correction, and (w_d, n) -> (theta, c).

    w_d and n of `loop` are white and of variance 1.
    """

    attitude: float
    correction: float
    loop: Any


def lqg(vehicle: Vehicle, scale: float, control_weight: float) -> Lqg:
    """The controller that makes E theta^2 + (control_weight · c)^2 least; weight in rad per normalized torque."""
    loop, plant, a = _loop(vehicle), vehicle.plant, disturbance_pole(vehicle.dt)
    n_p, n, tau = plant.nstates, loop.nstates, vehicle.delay
    # State: d and the loop that it drives, which the correction can move; then G driven by d alone, which is seen.
    m = 1 + n
    A = linalg.block_diag([[a]], loop.A, plant.A)
    A[1:m, 0], A[m:, 0] = loop.B[:, 0], plant.B[:, 0]
    into = np.zeros((m + n_p, 1))
    into[1:m, 0] = loop.B[:, 0]
    W = np.zeros((m + n_p, 2))
    W[0, 0], W[1:m, 1] = scale * np.sqrt(1.0 - a * a), NOISE_SIGMA * loop.B[:, 1]
    seen, direct = np.hstack([np.zeros((1, m)), plant.C]), np.array([[0.0, NOISE_SIGMA]])
    theta = np.zeros((1, m + n_p))
    row = OUTPUTS.index("theta")
    theta[0, 0], theta[0, 1:m] = loop.D[row, 0], loop.C[row]

    R, S = direct @ direct.T, W @ direct.T
    P = linalg.solve_discrete_are(A.T, seen.T, W @ W.T, R, s=S)
    power = seen @ P @ seen.T + R
    gain, ahead = P @ seen.T / power, (A @ P @ seen.T + S) / power
    F = _regulator(A[:m, :m], into[:m], theta[:, :m], tau, control_weight)
    read = np.hstack([F[:, :m], np.zeros((1, n_p))])

    # x, the delay line and the estimate's error; c(k) = -F [x(k|k); line]. G driven by d alone wanders and drops out.
    line, entry, exit_ = np.eye(tau, k=1), np.eye(tau, 1, k=1 - tau), np.eye(1, tau)
    ask = np.hstack([-F[:, :m], -F[:, m:], read @ (np.eye(m + n_p) - gain @ seen)])
    noisy = -read @ gain @ direct
    error = A - ahead @ seen
    kept = into[:m]
    closed = linalg.block_diag(A[:m, :m], line, error)
    driven = np.vstack([W[:m], np.zeros((tau, 2)), W - ahead @ direct])
    if tau:
        closed[:m, m : m + tau] += kept @ exit_
        closed[m : m + tau] += entry @ ask
        driven[m : m + tau] += entry @ noisy
    else:
        closed[:m] += kept @ ask
        driven[:m] += kept @ noisy
    out = np.vstack([np.hstack([theta[:, :m], np.zeros((1, tau + m + n_p))]), ask])
    feed = np.vstack([np.zeros((1, 2)), noisy])
    variance = np.diag(out @ gramian(closed, driven) @ out.T + feed @ feed.T)
    theta_rms, correction_rms = np.sqrt(variance).tolist()
    return Lqg(theta_rms, correction_rms, ct.ss(closed, driven, out, feed, vehicle.dt))


def coprime(plant: Any, angles: Array) -> tuple[Complex, Complex]:
    """M and N with G = N / M, both finite impulse responses, M(z) = prod (1 - p / z), at e^(j angle)."""
    z = np.exp(1j * angles)
    M = np.prod([1.0 - p / z for p in np.linalg.eigvals(plant.A)], axis=0)
    return M, M * response(plant, angles)[:, 0, 0]


def _loop(vehicle: Vehicle) -> Any:
    """The loop without observer; the link's delay then plays no part."""
    return close(Vehicle(vehicle.plant, vehicle.controller, 0, vehicle.attitude_gain), no_observer(vehicle.dt))


def _regulator(A: Array, B: Array, theta: Array, tau: int, weight: float) -> Array:
    """Gain (1, n + tau) on state and delay line (oldest first) that makes theta^2 + (weight c)^2 least."""
    n = len(A)
    late = linalg.block_diag(A, np.eye(tau, k=1))
    if tau:
        late[:n, n : n + 1] = B
    entry = np.vstack([np.zeros((n, 1)), np.eye(tau, 1, k=1 - tau)]) if tau else B
    cost = np.hstack([theta, np.zeros((1, tau))])
    R = np.array([[weight**2]])
    X = linalg.solve_discrete_are(late, entry, cost.T @ cost, R)
    return np.asarray(np.linalg.solve(R + entry.T @ X @ entry, entry.T @ X @ late))


def _inner(vehicle: Vehicle, z: Complex) -> Complex:
    """Inner factor of d -> theta: the plant's zeros outside the circle, and its samples of pure delay."""
    g = roots_of(vehicle.plant)
    first = z**-g.relative_degree
    return np.asarray(np.prod([(z - q) / (1.0 - np.conj(q) * z) for q in g.outer], axis=0) * first)


def _spectral_factor(power: Array) -> Complex:
    """The stable, minimum-phase factor of a spectrum, by its cepstrum (A. V. Oppenheim, R. W. Schafer, 1975)."""
    count = len(power)
    cepstrum = _coefficients(np.log(power).astype(complex))
    cepstrum[0] /= 2.0
    cepstrum[count // 2 :] = 0.0
    return np.asarray(np.exp(np.fft.fft(cepstrum * np.exp(-1j * np.pi * np.arange(count) / count))))


def _coefficients(values: Complex) -> Complex:
    """h of sum h_n z^-n from values at the angles of `lqg_attitude_bound`, negative n behind the middle."""
    count = len(values)
    return np.asarray(np.fft.ifft(values) * np.exp(1j * np.pi * np.arange(count) / count))
