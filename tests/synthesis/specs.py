"""Random design specs, sensible and absurd, as TOML text."""

import json

import numpy as np

AXES = ("roll", "pitch", "yaw")
EDGES = (0.0, 1.0, -1.0, 1.0 - 1e-12, 1.0 + 1e-9, 0.999999, 0.9962, 0.9447, 0.5, -0.8997, -1.716)
ABSURD = (1e-300, -1e-30, 1e-8, 2.777, 1e8, -1e30, 1e300)
RATES_HZ = (1e-300, 1e-3, 0.02, 0.5, 1.0, 50.0, 1e4, 1e6, 1e9, 1e300)
DELAYS = (8, 12, 31, 10**6, 10**40)
UNCERTAINTIES = (
    {"gain": [0.7, 1.3], "synthesis": "nominal"},
    {"delay_samples": [0, 1], "synthesis": "nominal"},
    {"gain": [1e-9, 1e9], "synthesis": "nominal"},
    {"pole": [{"nominal": 0.9, "range": [0.8, 0.95]}]},
    {"delay_samples": [0, 10**9]},
)


def random_spec(seed):
    """One block of one axis or two; each part is absurd once in a while."""
    return toml(Draw(seed).spec())


class Draw:
    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)
        self.wild = self.often(0.4)  # else nothing is absurd but the combination

    def often(self, share):
        return bool(self.rng.random() < share)

    def rarely(self, share):
        return self.wild and self.often(share)

    def one(self, among):
        return among[int(self.rng.integers(len(among)))]

    def spec(self):
        axes = self.one([AXES[:1], AXES[:1], AXES[1:2], AXES[1:2], AXES[:2]])
        head = {"rate_hz": self.one(RATES_HZ) if self.rarely(0.3) else 250.0}
        head["delay_samples"] = self.one(DELAYS) if self.rarely(0.1) else int(self.rng.integers(4))
        if self.rarely(0.2):
            head["gamma_backoff"] = self.one([1.0000001, 1.001, 1.2, 10.0])
        if self.rarely(0.2):
            head["largest_order"] = self.one([1, 2, 3, 10**40])
        return {"design": head, "block": [self.block(list(axes))]}

    def block(self, axes):
        block = {"name": axes[0], "axes": axes}
        if len(axes) == 1 and self.often(0.3):  # the paper's loop in other units
            unit = abs(self.size())
            block["plant"] = {"zeros": [-1.716], "poles": [1.0, 0.9447], "gain": 0.14131 * unit}
            block["controller"] = {"zeros": [0.8343, 0.9987], "poles": [0.0, 1.0], "gain": 0.9002 / unit}
        else:
            block |= {"plant": self.plant(axes), "controller": self.controller(axes)}
        block["weights"] = {"disturbance": self.weight(), "noise": self.weight()}
        if self.rarely(0.1):
            block["uncertainty"] = self.one(UNCERTAINTIES)
        return block

    def root(self):
        if self.rarely(0.1):
            return self.one(ABSURD)
        return self.one(EDGES) if self.often(0.1) else float(self.rng.uniform(-0.999, 0.999))

    def size(self):
        reach = 300.0 if self.rarely(0.05) else 12.0 if self.rarely(0.2) else 2.0
        return float(10.0 ** self.rng.uniform(-reach, reach) * self.one([1.0, 1.0, 1.0, -1.0]))

    def zpk(self, most=4, *, stable=False):
        count = int(self.rng.integers(1, most + 1))
        root = (lambda: float(self.rng.uniform(-0.95, 0.9999))) if stable and not self.rarely(0.1) else self.root
        poles = [root()] * count if self.often(0.2) else [root() for _ in range(count)]
        if count > 1 and self.often(0.2):
            radius, angle = self.rng.uniform(0.5, 1.0), self.rng.uniform(0.0, np.pi)
            poles = [[float(radius * np.cos(angle)), float(radius * np.sin(angle))], *poles[2:]]
        zeros = [self.root() for _ in range(int(self.rng.integers(count + 1)))]
        return {"zeros": zeros, "poles": poles, "gain": self.size()}

    def polynomial(self):
        degree = int(self.rng.integers(1, 5))
        den = np.real(np.poly(self.rng.uniform(-0.99, 0.99, degree))) if self.often(0.7) else [1.0, *self.sizes(degree)]
        return {"num": self.sizes(int(self.rng.integers(1, degree + 2))), "den": [float(x) for x in den]}

    def sizes(self, count):
        return [self.size() for _ in range(count)]

    def matrices(self, size):
        n = int(self.rng.integers(5))
        A = self.rng.normal(size=(n, n))
        A = A / max(np.max(np.abs(np.linalg.eigvals(A)), initial=0.0), 1.0)
        D = self.rng.normal(size=(size, size)) if self.often(0.3) else np.zeros((size, size))
        found = {"A": A, "B": self.rng.normal(size=(n, size)), "C": self.rng.normal(size=(size, n)), "D": D}
        found = {key: value.tolist() if n or key == "D" else [] for key, value in found.items()}
        if n and self.rarely(0.3):
            found[self.one("ABC")][0][0] = self.one([self.root(), self.size()])
        return found

    def plant(self, axes):
        kind = self.one(["zpk", "zpk", "polynomial", "matrices"])
        if kind == "matrices":
            model = self.matrices(len(axes))
        elif len(axes) > 1:
            model = {"entry": [{"from": axis, "to": axis} | self.zpk(2) for axis in axes]}
        else:
            model = self.zpk() if kind == "zpk" else self.polynomial()
        if self.often(0.1):
            model |= {"domain": "s", "method": self.one(["zoh", "foh", "tustin", "impulse"])}
        return model

    def controller(self, axes):
        """Mostly none at all, or hardly any: stable around a stable plant."""
        if self.rarely(0.2):
            return self.plant(axes)
        gain = 0.0 if self.often(0.7) else self.size()
        return {"A": [], "B": [], "C": [], "D": (gain * np.eye(len(axes))).tolist()}

    def weight(self):
        return self.polynomial() if self.often(0.1) else self.zpk(2, stable=True)


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
