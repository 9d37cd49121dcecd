"""Series and spectral factors on the warped circle: those of rational functions that are known."""

import numpy as np
import pytest

from dob_companion.synthesis.optimal.spectral import Circle, ratio_of


@pytest.fixture(scope="module")
def circle():
    return Circle(1024)


def star(values):
    return values.conj().swapaxes(1, 2)


def random_factor(z, rng, size):
    """Causal and stable with its inverse: unit triangular factors between diagonal ones."""
    phi = np.broadcast_to(np.eye(size), (len(z), size, size)).astype(complex)
    for part in (np.tril, np.triu):
        poles, zeros = rng.uniform(-0.3, 0.95, (2, size))
        lag = (1.0 - zeros / z[:, None]) / (1.0 - poles / z[:, None])
        mixing = np.eye(size) + (1.0 - np.eye(size)) * part(rng.standard_normal((size, size))) / z[:, None, None]
        phi = mixing @ (lag[:, :, None] * phi)
    return phi


def test_means_over_the_circle_are_those_over_even_angles(circle):
    z = np.exp(1j * circle.angles)
    power = np.abs(1.0 / (1.0 - 0.98 / z)) ** 2
    assert np.mean(circle.density) == pytest.approx(1.0, rel=1e-12)
    assert np.mean(power * circle.density) == pytest.approx(1.0 / (1.0 - 0.98**2), rel=1e-9)


def test_the_causal_part_keeps_what_is_stable_and_drops_what_is_not(circle):
    z = np.exp(1j * circle.angles)
    stable, other = 1.0 / (1.0 - 0.9 / z) + 0.3 / z**3, (1.0 / (1.0 - 0.7 * z) - 1.0) * 2.0
    h = circle.causal(stable + other)
    kept = circle.values(h)
    # In w the constant of `other` is not zero; only that may be left.
    left = kept - stable
    np.testing.assert_allclose(left, np.full_like(left, left[0]), atol=1e-9)
    np.testing.assert_allclose(circle.causal(kept), h, atol=1e-9)


@pytest.mark.parametrize("zero", [0.5, 0.98, 1.0])
def test_a_scalar_factor_is_the_stable_one_also_where_it_vanishes(circle, zero):
    z = np.exp(1j * circle.angles)
    phi = 2.0 * (1.0 - zero / z) * (1.0 + 0.3 / z) / (1.0 - 0.9 / z)
    np.testing.assert_allclose(circle.scalar_factor(np.abs(phi[:, None]) ** 2)[:, 0], phi, rtol=1e-5)


@pytest.mark.parametrize("size", [2, 4, 9])
def test_a_matrix_factor_times_its_conjugate_is_what_was_factored_and_it_and_its_inverse_are_causal(circle, size):
    rng = np.random.default_rng(size)
    true = random_factor(np.exp(1j * circle.angles), rng, size)
    H = star(true) @ true
    phi = circle.factor(H)
    np.testing.assert_allclose(ratio_of(H, phi), np.broadcast_to(np.eye(size), H.shape), atol=1e-8)
    for each in (phi, np.linalg.inv(phi)):
        np.testing.assert_allclose(circle.values(circle.causal(each)), each, atol=1e-8 * np.max(np.abs(each)))
    # Unique but for a constant orthogonal matrix.
    turn = true @ np.linalg.inv(phi)
    np.testing.assert_allclose(turn, np.broadcast_to(turn[0].real, turn.shape), atol=1e-7)
