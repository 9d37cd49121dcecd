"""Block diagrams by name: against python-control's own interconnection, and with their mistakes named."""

import control as ct
import numpy as np
import pytest

from dob_companion.lti.loop import weighted_loop
from dob_companion.lti.wiring import connected, spans

DT = 0.004
ANGLES = np.linspace(0.01, 3.1, 40)


def system(rng, order, outputs, inputs):
    A = rng.normal(size=(order, order))
    A *= 0.7 / max(abs(np.linalg.eigvals(A)))
    return ct.ss(
        A, rng.normal(size=(order, inputs)), rng.normal(size=(outputs, order)), np.zeros((outputs, inputs)), DT
    )


def test_a_loop_is_the_one_that_python_control_connects():
    rng = np.random.default_rng(1)
    plant, controller = system(rng, 3, 1, 1), system(rng, 2, 1, 1)
    ours = connected(
        (plant, controller),
        into={"moment": {"u": 1.0, "d": 1.0}, "measured": {"y": -0.5, "n": -2.0}},
        give=("y", "u"),
        outside=("d", "n"),
        read={"sum": {"y": 1.0, "u": 3.0, "n": 1.0}},
        size=dict.fromkeys(("moment", "measured", "y", "u", "d", "n", "sum"), 1),
    )
    scaled = ct.ss(controller.A, controller.B, controller.C, controller.D, DT, inputs="e", outputs="u")
    named = ct.ss(plant.A, plant.B, plant.C, plant.D, DT, inputs="v", outputs="y")
    sums = [
        ct.summing_junction(["u", "d"], "v"),
        ct.ss([], [], [], [[-0.5, -2.0]], DT, inputs=["y", "n"], outputs="e"),
        ct.ss([], [], [], [[1.0, 3.0, 1.0]], DT, inputs=["y", "u", "n"], outputs="z"),
    ]
    theirs = ct.interconnect([named, scaled, *sums], inputs=["d", "n"], outputs=["z"])
    for angle in ANGLES:
        z = np.exp(1j * angle)
        assert ct.ss(*ours, DT)(z, squeeze=False) == pytest.approx(theirs(z, squeeze=False), rel=1e-9)


def test_signals_of_several_components_stand_one_behind_the_other():
    assert spans(("a", "b", "c"), {"a": 2, "b": 1, "c": 3}) == {"a": slice(0, 2), "b": slice(2, 3), "c": slice(3, 6)}


def test_a_signal_that_nothing_gives_is_named():
    part = ct.ss([], [], [], [[1.0]], DT)
    with pytest.raises(KeyError, match="late"):
        connected(
            (part,),
            into={"moment": {"late": 1.0}},
            give=("y",),
            outside=(),
            read={},
            size={"moment": 1, "y": 1, "late": 1},
        )


def test_the_weighted_loop_of_two_moments_is_that_of_each_where_nothing_couples_them():
    rng = np.random.default_rng(2)
    one = [system(rng, 2, 1, 1), system(rng, 1, 1, 1), system(rng, 2, 1, 2), system(rng, 1, 1, 1), system(rng, 1, 1, 1)]
    twice = [ct.append(part, part) for part in one]
    observer = twice[2]  # of [y_1; u_1; y_2; u_2]; a design's is of [y; u]
    order = [0, 2, 1, 3]
    twice[2] = ct.ss(observer.A, observer.B[:, order], observer.C, observer.D[:, order], DT)
    single, double = weighted_loop(*one, 2), weighted_loop(*twice, 2)
    for name in ("y_n", "u_e", "d_hat", "error"):
        C, D = getattr(single, name)
        both = ct.ss(double.A, double.B, *getattr(double, name), DT)
        for angle in ANGLES[::5]:
            z = np.exp(1j * angle)
            alone = ct.ss(single.A, single.B, C, D, DT)(z, squeeze=False)
            inputs = [0, 2]  # w_d and w_n of the first
            assert both(z, squeeze=False)[:1, inputs] == pytest.approx(alone, rel=1e-9)
            assert both(z, squeeze=False)[:1, [1, 3]] == pytest.approx(0.0, abs=1e-12)
