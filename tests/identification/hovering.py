"""A hovering aircraft for tests: linear, in closed loop, in the frequency domain, so that its truth is in closed form.

All signals are periodic over the whole record, which makes the loop's answer exact: no transient, no step of an
integration, any delay. Nothing here comes from the identification.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from dob_companion.identification.record import Facts, Record, Signal


@dataclass(frozen=True, kw_only=True)
class Axis:
    """K e^(-s delay) / ((s + pole) (1 + s lag)) times `shape`; the rate loop is PI with `attitude` (1/s) around it."""

    gain: float = 250.0
    pole: float = 2.0
    lag: float = 0.04
    delay: float = 0.006
    shape: Callable[[np.ndarray], np.ndarray] = field(default=np.ones_like)
    p: float = 0.08
    i: float = 0.05
    attitude: float = 4.0
    injected: float = 0.03
    pilot: float = 0.0
    wind: float = 3.0
    noise: float = 0.005

    def at(self, s: np.ndarray) -> np.ndarray:
        """Its transfer function."""
        return self.gain * np.exp(-s * self.delay) / ((s + self.pole) * (1.0 + s * self.lag)) * self.shape(s)

    def held(self, w: np.ndarray, dt: float, terms: int = 12) -> np.ndarray:
        """Behind a hold, sampled: Poisson's sum over the frequencies that sampling takes for one."""
        k = np.arange(-terms, terms + 1)[:, None]
        s = 1j * (w + 2.0 * np.pi / dt * k)
        return np.sum((1.0 - np.exp(-1j * w * dt)) / (s * dt) * self.at(s), axis=0)


@dataclass(frozen=True)
class Flight:
    """rates, moment, injected, attitude_setpoint and rate_setpoint, shape (n, 3), at `dt`."""

    dt: float
    y: np.ndarray
    u: np.ndarray
    r: np.ndarray
    asked: np.ndarray
    rate_asked: np.ndarray


def fly(axes, seconds: float, seed: int, *, rate_hz=250.0, coupling=0.0, band=(0.15, 25.0), moved=None) -> Flight:
    """Three axes in hover. `coupling`: how much of each neighbour's moment moves an axis, of its own gain. Injected is
    random over `band` (Hz), or `moved` (n, 3), each of the axis' rms."""
    rng = np.random.default_rng(seed)
    n, dt = int(seconds * rate_hz), 1.0 / rate_hz
    w = 2.0 * np.pi * np.fft.rfftfreq(n, dt)
    w[0] = 1.0
    axes = list(axes)
    G = np.zeros((len(w), 3, 3), complex)
    held = {axis: axis.held(w, dt) for axis in set(axes)}
    plants = [held[axis] for axis in axes]
    for i in range(3):
        for j in range(3):
            G[:, i, j] = plants[i] if i == j else coupling * plants[i]
    C = np.stack([axis.p + axis.i / (1j * w) for axis in axes], axis=1)
    outer = np.stack([axis.attitude / (1j * w) for axis in axes], axis=1)

    def white():
        return np.fft.rfft(rng.standard_normal((n, 3)), axis=0)

    hertz = w[:, None] / (2.0 * np.pi)
    injected = (
        np.fft.rfft(moved, axis=0)
        if moved is not None
        else white() / np.sqrt(hertz) * ((hertz >= band[0]) & (hertz <= band[1]))
    )
    injected *= np.array([axis.injected for axis in axes]) / np.maximum(_rms(injected, n), 1e-12)
    pilot = white() / (1.0 + (hertz / 0.7) ** 2) ** 1.0
    pilot *= np.array([axis.pilot for axis in axes]) / _rms(pilot, n)
    wind = white() / (1.0 + 1j * hertz / 1.0)  # rad/s², a gust through the same mass
    wind *= np.array([axis.wind for axis in axes]) / _rms(wind, n) / (1j * w[:, None] + 1.0)
    noise = white() * np.array([axis.noise for axis in axes])
    loop = C * (1.0 + outer)  # u = r - C (1 + a/s) y + C a theta_asked
    drive = injected + C * np.array([axis.attitude for axis in axes]) * pilot
    # y = G u + wind + noise, u = drive - loop y
    A = np.eye(3) + G * loop[:, None, :]
    y = np.linalg.solve(A, np.einsum("wij,wj->wi", G, drive)[..., None] + (wind + noise)[..., None])[..., 0]
    u = drive - loop * y
    rate_asked = np.array([axis.attitude for axis in axes]) * pilot - outer * y
    signals = [y, u, injected, pilot, rate_asked]
    for signal in signals:
        signal[0] = 0.0
    return Flight(dt, *(np.fft.irfft(signal, n, axis=0) for signal in signals))


def _rms(spectrum: np.ndarray, n: int) -> np.ndarray:
    return np.sqrt(np.mean(np.fft.irfft(spectrum, n, axis=0) ** 2, axis=0))


def record(flight: Flight, **changes) -> Record:
    """As a reader would hand it over; injected and attitude setpoint only where there is some."""
    time = flight.dt * np.arange(len(flight.y))
    whole = Record(
        source="test",
        rates=Signal(time, flight.y),
        moment=Signal(time, flight.u),
        injected=Signal(time, flight.r) if np.any(flight.r) else None,
        attitude_setpoint=Signal(time, flight.asked) if np.any(flight.asked) else None,
        rate_setpoint=Signal(time, flight.rate_asked),
        armed=Facts(np.zeros(1), np.ones(1, bool)),
        flying=Facts(np.zeros(1), np.ones(1, bool)),
    )
    return replace(whole, **changes)
