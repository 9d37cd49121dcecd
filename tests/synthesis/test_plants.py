"""Every plant of docs/plants.md: certified, and optimal by two methods."""

import numpy as np
import pytest

from bench import plants
from bench._plants import all_plants
from dob_companion.synthesis import synthesize
from dob_companion.synthesis.solve.optimum import BOTH
from tests.effort import a_few

PLANTS = {plant.name: plant for plant in all_plants()}


def test_there_are_at_least_twenty_five_plants():
    assert len(PLANTS) >= 25


@pytest.mark.parametrize("name", a_few(PLANTS, every=3))
def test_the_observer_is_certified_within_the_back_off(name):
    plant = PLANTS[name]
    result = synthesize(*plant.arguments, delay_samples=plant.delay)
    certificate = result.certificate
    p, m = plant.plant.D.shape
    assert certificate.gamma <= 1.01 * certificate.gamma_star
    assert certificate.gamma >= certificate.gamma_star * (1 - 1e-9)
    assert certificate.command_leak <= 1e-6
    assert certificate.observer_spectral_radius < 1
    assert certificate.closed_loop_spectral_radius < 1
    assert "LMI" in certificate.gamma_star_method
    assert "Riccati" in certificate.gamma_star_method
    assert np.all(result.observer.D[:, p:] == 0.0)
    assert result.observer.D.shape == (m, p + m)


def test_what_two_gyros_know_without_error_does_not_spoil_the_coordinates():
    """Their difference is noise alone, known exactly; scaled up, its rounding left only an observer of higher order."""
    plant = PLANTS["two gyros, one moment"]
    result = synthesize(*plant.arguments, delay_samples=plant.delay)
    assert result.observer.nstates == 4
    assert result.certificate.command_leak <= 1e-10
    assert result.certificate.gamma_star_method == BOTH


def peer(trouble):
    def solve(*_):
        raise trouble

    return plants.Peer("a solver", solve)


@pytest.mark.parametrize("trouble", [np.linalg.LinAlgError("singular"), RuntimeError("info 3"), ZeroDivisionError()])
def test_a_peer_that_gives_up_is_counted_as_a_failure(trouble):
    assert plants._achieved(peer(trouble), all_plants()[0]) is None


def test_a_peer_that_gives_nothing_is_counted_as_a_failure():
    assert plants._achieved(plants.Peer("a solver", lambda *_: None), all_plants()[0]) is None


@pytest.mark.parametrize("trouble", [TypeError("an argument is missing"), AttributeError("nstate"), KeyError("gain")])
def test_a_fault_of_the_comparison_itself_is_not_counted_as_a_peers(trouble):
    with pytest.raises(type(trouble)):
        plants._achieved(peer(trouble), all_plants()[0])
