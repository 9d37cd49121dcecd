"""The autopilots' own rate controllers, step by step as their sources run them, and how they answer to a sine."""

import math

import numpy as np


def answer(step, hz, loop_hz):
    """What a controller, `step(rate, dt)`, answers to the streamed rate sin(w t): -C as a complex number."""
    dt = 1.0 / loop_hz
    settle, count = round(4.0 * loop_hz), round(loop_hz * round(20 * hz) / hz)
    t = dt * np.arange(settle + count)
    out = np.array([step(math.sin(2.0 * math.pi * hz * x), dt) for x in t])[settle:]
    turn = np.exp(-2j * math.pi * hz * t[settle:])
    return complex(2j * np.mean((out - np.mean(out)) * turn))


OVERSAMPLED = 5
"""Gyro samples in a loop of PX4's; what holds its torque in between is taken out again."""


class AcPid:
    """AC_PID::update_all for a target of 0."""

    def __init__(self, p, i, d, error_hz, derivative_hz):
        self.p, self.i, self.d, self.error_hz, self.derivative_hz = p, i, d, error_hz, derivative_hz
        self.error = self.derivative = self.integrator = 0.0

    @staticmethod
    def alpha(dt, hz):
        return dt / (dt + 1.0 / (2.0 * math.pi * hz)) if hz else 1.0

    def __call__(self, measurement, dt):
        last = self.error
        self.error += self.alpha(dt, self.error_hz) * (-measurement - self.error)
        self.derivative += self.alpha(dt, self.derivative_hz) * ((self.error - last) / dt - self.derivative)
        self.integrator += self.error * self.i * dt
        return self.p * self.error + self.d * self.derivative + self.integrator


class LowPass2p:
    """LowPassFilter2p of both autopilots."""

    def __init__(self, sample_hz, cutoff_hz):
        ohm = math.tan(math.pi * cutoff_hz / sample_hz)
        c = 1.0 + 2.0 * math.cos(math.pi / 4.0) * ohm + ohm * ohm
        self.b = (ohm * ohm / c, 2.0 * ohm * ohm / c, ohm * ohm / c)
        self.a = (2.0 * (ohm * ohm - 1.0) / c, (1.0 - 2.0 * math.cos(math.pi / 4.0) * ohm + ohm * ohm) / c)
        self.state = [0.0, 0.0]

    def __call__(self, sample):
        x = sample - self.state[0] * self.a[0] - self.state[1] * self.a[1]
        out = x * self.b[0] + self.state[0] * self.b[1] + self.state[1] * self.b[2]
        self.state = [x, self.state[0]]
        return out


class Px4Rate:
    """RateControl::update for a setpoint of 0 on the output of VehicleAngularVelocity, and yaw's filter."""

    def __init__(self, p, i, d, k, loop_hz, cutoff_hz, derivative_hz, yaw_hz=0.0):
        self.p, self.i, self.d, self.k, self.yaw_hz = p, i, d, k, yaw_hz
        self.low_pass, self.derivative_hz = LowPass2p(loop_hz * OVERSAMPLED, cutoff_hz), derivative_hz
        self.count = -1
        self.rate = self.acceleration = self.integral = self.torque = 0.0

    def __call__(self, raw, dt):
        self.count = (self.count + 1) % OVERSAMPLED
        last, self.rate = self.rate, self.low_pass(raw)
        change = (self.rate - last) / dt
        self.acceleration += AcPid.alpha(dt, self.derivative_hz) * (change - self.acceleration)
        if self.count:
            return self.torque
        dt *= OVERSAMPLED
        torque = self.k * (-self.p * self.rate - self.d * self.acceleration) + self.integral
        self.integral -= self.k * self.i * self.rate * dt
        self.torque += AcPid.alpha(dt, self.yaw_hz) * (torque - self.torque)
        return self.torque


def ardupilot_notch(sample_hz, centre_hz, width_hz, attenuation_db, hz):
    """NotchFilter.cpp at a frequency."""
    A = 10.0 ** (-attenuation_db / 40.0)
    octaves = math.log2(centre_hz / (centre_hz - width_hz / 2.0)) * 2.0
    Q = math.sqrt(2.0**octaves) / (2.0**octaves - 1.0)
    omega = 2.0 * math.pi * centre_hz / sample_hz
    alpha = math.sin(omega) / (2.0 * Q)
    z = np.exp(-2j * math.pi * hz / sample_hz) ** np.arange(3)
    b = np.array([1.0 + alpha * A * A, -2.0 * math.cos(omega), 1.0 - alpha * A * A])
    a = np.array([1.0 + alpha, -2.0 * math.cos(omega), 1.0 - alpha])
    return complex(b @ z / (a @ z))


def px4_notch(sample_hz, centre_hz, width_hz, hz):
    """NotchFilter.hpp at a frequency."""
    alpha, beta = math.tan(math.pi * width_hz / sample_hz), -math.cos(2.0 * math.pi * centre_hz / sample_hz)
    z = np.exp(-2j * math.pi * hz / sample_hz) ** np.arange(3)
    return complex(np.array([1.0, 2.0 * beta, 1.0]) @ z / (np.array([1.0 + alpha, 2.0 * beta, 1.0 - alpha]) @ z))
