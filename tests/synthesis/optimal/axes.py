"""The shipped tuned axes, as the programmes take them."""

from dob_companion.comparison.flight import DISTURBANCE_HZ, NOISE_SIGMA, PEAKS_OFF, make_weather
from dob_companion.comparison.vehicle import ATTITUDE_GAIN, Vehicle
from dob_companion.synthesis import parse_spec
from dob_companion.synthesis.optimal.problem import Axis, Block, Spectrum
from dob_companion.synthesis.plant.models import to_state_space
from dob_companion.synthesis.spec.spectrum import LowPass
from docs.shipped import EXAMPLES, SPECS

NOISE = NOISE_SIGMA


def block_of(name, delay=1):
    spec = parse_spec((EXAMPLES / SPECS[delay]).read_text(encoding="utf-8"))
    return next(block for block in spec.blocks if block.name == name)


def vehicle_of(name, delay=1):
    block = block_of(name, delay)
    plant, controller = (to_state_space(model, 0.004, (1, 1)) for model in (block.plant, block.controller))
    return Vehicle(plant, controller, delay)


def axis_of(name, delay=1):
    vehicle = vehicle_of(name, delay)
    return Axis.of(vehicle.plant, vehicle.controller, delay, ATTITUDE_GAIN)


def single_of(name, delay=1):
    vehicle = vehicle_of(name, delay)
    return Block(vehicle.plant, vehicle.controller, (delay,), ATTITUDE_GAIN)


def weather_of(name, delay=1, seeds=3):
    return Spectrum(
        LowPass(DISTURBANCE_HZ), make_weather(vehicle_of(name, delay), PEAKS_OFF[name], seeds).typical_scale
    )
