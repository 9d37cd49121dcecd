"""A plant behind a hold, against sums over aliases and against scipy's matrix exponential."""

import numpy as np
import pytest
from scipy.signal import cont2discrete

from dob_companion.autopilots.transfer import Transfer, butterworth
from dob_companion.identification.held import held_response

DT = 0.004
FREQUENCY = np.geomspace(0.5, 600.0, 40)
PLANT = Transfer((300.0,), (1.0, 2.4)) * Transfer((1.0,), (0.04, 1.0)) * butterworth(20.0)


def by_aliases(transfer: Transfer, delay_s: float, terms: int = 4000) -> np.ndarray:
    """Poisson's sum: the hold's spectrum times the plant's at all frequencies that sampling takes for one."""
    k = np.arange(-terms, terms + 1)[:, None]
    s = 1j * (FREQUENCY + 2.0 * np.pi / DT * k)
    hold = (1.0 - np.exp(-1j * FREQUENCY * DT)) / (s * DT)
    return np.sum(hold * np.polyval(transfer.num, s) / np.polyval(transfer.den, s) * np.exp(-s * delay_s), axis=0)


@pytest.mark.parametrize("delay_s", [0.0, 0.0013, 0.004, 0.0093])
def test_a_delay_of_any_part_of_a_sample_is_exact(delay_s):
    got = held_response(PLANT.num, PLANT.den, delay_s, DT, FREQUENCY)
    np.testing.assert_allclose(got, by_aliases(PLANT, delay_s), rtol=1e-5)


def test_an_integrator_and_a_lag_of_zero_are_as_their_limits():
    num, den, _ = cont2discrete(([250.0], [0.05, 1.0, 0.0]), DT)
    z = np.exp(1j * FREQUENCY * DT)
    expected = np.polyval(num[0], z) / np.polyval(den, z)
    np.testing.assert_allclose(held_response([250.0], [0.05, 1.0, 0.0], 0.0, DT, FREQUENCY), expected, rtol=1e-9)
    np.testing.assert_allclose(held_response([250.0], [0.0, 1.0, 0.0], 0.0, DT, FREQUENCY), 250.0 * DT / (z - 1.0))


def test_poles_that_coincide_do_no_harm():
    twice = butterworth(20.0) * butterworth(20.0) * Transfer((1.0,), (1.0, 0.0))
    got = held_response(twice.num, twice.den, 0.002, DT, FREQUENCY)
    np.testing.assert_allclose(got, by_aliases(twice, 0.002), rtol=1e-3)


def test_what_cannot_be_held_is_refused():
    with pytest.raises(ValueError, match="strictly proper"):
        held_response([1.0, 2.0], [1.0, 3.0], 0.0, DT, FREQUENCY)
    with pytest.raises(ValueError, match="delay"):
        held_response([1.0], [1.0, 3.0], -0.001, DT, FREQUENCY)
