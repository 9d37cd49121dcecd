"""`Tailsitter`: the nonlinear airframe, advanced one sample at a time."""

import struct

import numpy as np

from sitl.airframe.condition import Condition
from sitl.airframe.mixer import Mixer
from sitl.airframe.surroundings import Surroundings
from sitl.attitude import LEVEL, ZERO, Quaternion, Vector
from sitl.constants import DT
from sitl.tailsitter.body import STEPS, sample, workspace
from sitl.tailsitter.layout import (
    CHARGE,
    DISTURBANCE,
    INPUTS,
    OUTPUTS,
    POSITION,
    QUATERNION,
    RATE,
    STATES,
    VELOCITY,
)
from sitl.tailsitter.parameters import Parameters

_PACK = struct.Struct(f"{INPUTS}d")
_NO_AXIS = -1.0


def rotor_mixer(p: Parameters) -> Mixer:
    """How normalized torque and thrust go to the rotors of this vehicle."""
    return Mixer(p.mixer_share, p.idle, 1.0)


class Tailsitter:
    """The tail-sitter of `parameters`, standing on its tail at the take-off point; an `Airframe`.

    It leaves the ground when its rotors carry it and stands again, upright, when it comes down to it, however hard:
    there is no crash. On the ground nothing but the rotors moves.
    """

    def __init__(self, parameters: Parameters | None = None) -> None:
        self.parameters = p = parameters or Parameters()
        self.condition = Condition()
        self._params = p.record()
        self._rotors = rotor_mixer(p)
        self._buffer = bytearray(_PACK.size)
        self._inputs = np.frombuffer(self._buffer)
        self._before = np.zeros(7)
        self._work = workspace()
        self._sensed = np.zeros(OUTPUTS)
        self.state = np.zeros(STATES)
        self.state[QUATERNION] = 1.0
        self.on_ground = True
        self._read()

    @property
    def altitude(self) -> float:
        """Above the take-off point, m."""
        return -self.position[2]

    @property
    def climb(self) -> float:
        """Upwards, m/s."""
        return -self.velocity[2]

    def advance(self, torque: Vector, thrust: float, around: Surroundings) -> None:
        """Fly one sample; see `Airframe.advance`."""
        c = self.condition
        held = _NO_AXIS if c.held_axis is None else c.held_axis
        standing = self.on_ground and c.held_axis is None
        _PACK.pack_into(
            self._buffer,
            0,
            *self._rotors.commands(torque, thrust),
            *(ZERO if standing else around.torque),
            *around.moment,
            *around.wind,
            *around.wind_rate,
            around.wall_m,
            *c.rotor_effectiveness,
            *c.gain,
            c.payload_kg,
            c.battery_charge,
            c.battery_sag,
            c.flexible,
            held,
            standing,
        )
        sample(self.state, self._inputs, self._before, self._params, DT, STEPS, self._work, self._sensed)
        self._read()
        if standing:
            self.on_ground = self._lift <= 0.0
        elif c.held_axis is not None:
            self._hold(c.held_axis)
        elif self.position[2] > 0.0:
            self._touch_down()

    def _read(self) -> None:
        """Take state and sensors out of the vectors."""
        n, e, d, vn, ve, vd, w, x, y, z, p, q, r = self.state[: RATE + 3].tolist()
        fx, fy, fz, _, _, down, a, b, c = self._sensed.tolist()
        self.position: Vector = (n, e, d)
        self.velocity: Vector = (vn, ve, vd)
        self.attitude: Quaternion = (w, x, y, z)
        self.rate: Vector = (p + a, q + b, r + c)
        self.specific_force: Vector = (fx, fy, fz)
        self._lift = -down  # acceleration upwards if nothing held it, m/s²

    def _hold(self, axis: int) -> None:
        """On the rod it neither moves nor turns about another axis, whatever it did before."""
        self.state[VELOCITY : VELOCITY + 3] = 0.0
        self.state[RATE : RATE + 3] *= np.eye(3)[axis]
        self.on_ground = False
        self._read()

    def _touch_down(self) -> None:
        """Stand where it came down, upright and still, with its rotors as they are."""
        x = self.state
        x[POSITION + 2] = 0.0
        x[VELOCITY : VELOCITY + 3] = 0.0
        x[QUATERNION : QUATERNION + 4] = LEVEL
        x[RATE : RATE + 3] = 0.0
        x[DISTURBANCE:CHARGE] = 0.0
        self._sensed[:] = (0.0, 0.0, -self.parameters.gravity, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        self.on_ground = True
        self._read()
