"""Random design specs, sensible and absurd, as TOML text."""

import json

from hypothesis import strategies as st

AXES = ("roll", "pitch", "yaw")

edges = st.sampled_from([0.0, 1.0, -1.0, 1.0 - 1e-12, 1.0 + 1e-9, 0.999999, 0.9962, 0.9447, 0.5, -0.8997, -1.716])
insides = st.floats(-0.999, 0.999)
absurd = st.sampled_from([1e-300, -1e-30, 1e-8, 2.777, 1e8, -1e30, 1e300])
signs = st.sampled_from([1.0, 1.0, 1.0, -1.0])


def one_of(usual, *rare):
    """Mostly the usual."""
    return st.one_of(usual, usual, usual, *rare)


roots = one_of(insides, edges, absurd)
sizes = one_of(st.floats(-2.0, 1.0), st.floats(-12.0, 12.0), st.floats(-300.0, 300.0)).map(lambda e: 10.0**e)
gains = st.builds(lambda sign, size: sign * size, signs, sizes)


@st.composite
def zpks(draw, pole=roots, most=4):
    poles = draw(st.lists(pole, min_size=1, max_size=most))
    if draw(st.integers(0, 4)) == 0:
        poles = poles[:1] * draw(st.integers(1, most))  # a chain of equal lags
    real = draw(st.lists(roots, max_size=len(poles)))
    pair = draw(st.integers(0, 4)) == 0 and len(poles) > 1
    listed = [[poles[0], draw(st.floats(-1.0, 1.0))], *poles[2:]] if pair else poles
    return {"zeros": real, "poles": listed, "gain": draw(gains)}


@st.composite
def polynomials(draw):
    den = [1.0, *draw(st.lists(gains, min_size=1, max_size=4))]
    return {"num": draw(st.lists(gains, min_size=1, max_size=len(den))), "den": den}


@st.composite
def matrices(draw, inputs, outputs):
    n = draw(st.integers(0, 4))
    entry = one_of(st.floats(-1.0, 1.0), gains, edges)

    def matrix(rows, columns):
        return [[draw(entry) for _ in range(columns)] for _ in range(rows)]

    D = matrix(outputs, inputs) if draw(st.booleans()) else [[0.0] * inputs for _ in range(outputs)]
    return {"A": matrix(n, n), "B": matrix(n, inputs), "C": matrix(outputs, n) if n else [], "D": D}


@st.composite
def plants(draw, axes):
    if len(axes) == 1:
        model = draw(st.one_of(zpks(), zpks(), polynomials(), matrices(1, 1)))
    elif draw(st.booleans()):
        model = draw(matrices(len(axes), len(axes)))
    else:
        model = {"entry": [{"from": axis, "to": axis} | draw(zpks(most=2)) for axis in axes]}
    if draw(st.integers(0, 3)) == 0:
        model |= {"domain": "s", "method": draw(st.sampled_from(["zoh", "foh", "tustin", "impulse"]))}
    return model


@st.composite
def controllers(draw, axes):
    """Often none at all, which is stable around a stable plant."""
    size = len(axes)
    kind = draw(st.sampled_from(["none", "none", "gain", "any"]))
    if kind == "any":
        return draw(plants(axes))
    gain = 0.0 if kind == "none" else draw(gains)
    return {"A": [], "B": [], "C": [], "D": [[gain * (i == j) for j in range(size)] for i in range(size)]}


weights = st.one_of(zpks(pole=insides, most=2), zpks(pole=insides, most=2), zpks(), polynomials())


uncertainties = st.sampled_from(
    [
        {"gain": [0.7, 1.3], "synthesis": "nominal"},
        {"delay_samples": [0, 1], "synthesis": "nominal"},
        {"gain": [1e-9, 1e9], "synthesis": "nominal"},
        {"pole": [{"nominal": 0.9, "range": [0.8, 0.95]}]},
        {"delay_samples": [0, 10**9]},
    ]
)


@st.composite
def blocks(draw, axes):
    block = {"name": axes[0], "axes": list(axes), "plant": draw(plants(axes)), "controller": draw(controllers(axes))}
    block["weights"] = {"disturbance": draw(weights), "noise": draw(weights)}
    if draw(st.integers(0, 9)) == 0:
        block["uncertainty"] = draw(uncertainties)
    return block


@st.composite
def specs(draw):
    axes = draw(st.sampled_from([AXES[:1], AXES[:1], AXES[1:2], AXES[:2]]))
    rates = one_of(st.just(250.0), st.sampled_from([1e-300, 1e-3, 0.5, 1.0, 50.0, 1e4, 1e9, 1e300]))
    delays = one_of(st.integers(0, 3), st.sampled_from([51, 10**6, 10**40]))
    head = {"rate_hz": draw(rates), "delay_samples": draw(delays)}
    if draw(st.integers(0, 5)) == 0:
        head["gamma_backoff"] = draw(st.sampled_from([1.0000001, 1.001, 1.2, 10.0]))
    if draw(st.integers(0, 5)) == 0:
        head["largest_order"] = draw(st.sampled_from([1, 2, 3, 10**40]))
    return toml({"design": head, "block": [draw(blocks(axes))]})


def toml(spec):
    """TOML of tables of numbers, texts, lists and tables."""
    head = "\n".join(f"{key} = {_value(value)}" for key, value in spec["design"].items())
    listed = ("\n".join(f"{key} = {_value(value)}" for key, value in block.items()) for block in spec["block"])
    return f"[design]\n{head}\n" + "".join(f"[[block]]\n{text}\n" for text in listed)


def _value(value):
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_value(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    return json.dumps(value)
