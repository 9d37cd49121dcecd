"""A design spec: TOML text in, frozen dataclasses out. Pure; no file is opened and nothing is converted here.

Every complaint is a SpecError of one line that names the file and the key; an unknown key is answered
with the nearest known one. `plant/models.py` turns the models below into state space.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from dob_companion import toml
from dob_companion.artifact import AXES
from dob_companion.errors import SpecError
from dob_companion.synthesis.spec.auto import AutoSpec, overridden, parse_auto
from dob_companion.synthesis.spec.limits import LONGEST_DELAY
from dob_companion.synthesis.spec.model_file import Reader, with_model_files
from dob_companion.synthesis.spec.spectrum_file import with_spectrum_file
from dob_companion.synthesis.spec.uncertainty import Uncertainty, parse_uncertainty
from dob_companion.toml import Table, is_number, shown

METHODS = ("zoh", "foh", "tustin", "impulse")
"""Named ways from continuous to discrete time."""

RATES_HZ = 1e-3, 1e6
"""Slowest and fastest rate of a spec."""

FORMS = {"zpk": ("zeros", "poles", "gain"), "polynomial": ("num", "den"), "matrices": ("A", "B", "C", "D")}
_FORM_KEYS = tuple(key for keys in FORMS.values() for key in keys)
_TIME_KEYS = ("domain", "method", "delay_s")
_MODEL_KEYS = (*_FORM_KEYS, *_TIME_KEYS)

Rows = tuple[tuple[float, ...], ...]


@dataclass(frozen=True, slots=True)
class Zpk:
    """gain * prod(s - zeros) / prod(s - poles), s being z or s; complex roots stand with their conjugates."""

    zeros: tuple[complex, ...]
    poles: tuple[complex, ...]
    gain: float


@dataclass(frozen=True, slots=True)
class Polynomial:
    """num / den, coefficients in descending powers."""

    num: tuple[float, ...]
    den: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Matrices:
    """State space as nested rows; shapes are checked by `plant/models.py`."""

    A: Rows
    B: Rows
    C: Rows
    D: Rows


@dataclass(frozen=True, slots=True)
class Entries:
    """A transfer matrix: (output, input) -> model, an absent entry being 0."""

    size: int
    items: tuple[tuple[int, int, "Model"], ...]


@dataclass(frozen=True, slots=True)
class Model:
    """One linear model as written, and where it was written (for messages).

    `delay_s` stands before a continuous model behind a zero-order hold, any fraction of a sample.
    """

    form: Zpk | Polynomial | Matrices | Entries
    where: str
    domain: str = "z"
    method: str = "zoh"
    delay_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Weight:
    """A weighting filter: one for every channel, or own ones per channel index, or both."""

    where: str
    common: Model | None
    own: tuple[tuple[int, Model], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockSpec:
    """One block: a SISO axis, or several coupled ones. Only a block with an [auto] may leave the weights out.

    largest_disturbance is what the block is asked to reject, normalized torque; None where the spec does not say.
    auto is the spec's [auto] with the block's own keys in it; None where neither has one.
    """

    where: str
    name: str
    axes: tuple[str, ...]
    delay_samples: int
    plant: Model
    controller: Model
    disturbance: Weight | None
    noise: Weight | None
    gamma_backoff: float
    uncertainty: Uncertainty | None = None
    largest_order: int | None = None
    largest_disturbance: float | None = None
    auto: AutoSpec | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Spec:
    """A whole design spec. rate_hz in Hz; gamma_backoff > 1; delay_samples counts the link only."""

    rate_hz: float
    delay_samples: int
    gamma_backoff: float
    blocks: tuple[BlockSpec, ...]
    source: str = field(default="spec")

    @property
    def auto(self) -> AutoSpec | None:
        """What is asked of the first block that is asked for something."""
        return next((block.auto for block in self.blocks if block.auto), None)

    @property
    def dt(self) -> float:
        """Sample time in s."""
        return 1.0 / self.rate_hz


def parse_spec(text: str, source: str = "spec.toml", read: Reader | None = None) -> Spec:
    """Read a design spec; `read` fetches the model files that it names (`model_file`).

    Raises SpecError, one line that begins with `source`.
    """
    return spec_of(read_spec(text, source, read), source)


def read_spec(text: str, source: str = "spec.toml", read: Reader | None = None) -> dict[str, Any]:
    """The text's tables, what it names in files put in its place. Raises SpecError."""
    return with_spectrum_file(with_model_files(toml.read(text, source), source, read), source, read)


def spec_of(raw: dict[str, Any], source: str) -> Spec:
    """A spec from its tables. Raises SpecError."""
    top = Table(source, raw, ("design", "block", "auto"))
    head = top.table("design", ("rate_hz", "delay_samples", "gamma_backoff", "largest_order"))
    slow, fast = RATES_HZ
    rate = head.number("rate_hz", lambda x: slow <= x <= fast, f"a positive number of Hz, from {slow:g} to {fast:g}")
    delay = head.whole("delay_samples", 1, LONGEST_DELAY)
    backoff = _backoff(head, 1.01)
    order = _order(head, None)
    given = _Given(rate, delay, order, backoff, top.open("auto") if "auto" in top else None)
    blocks = tuple(_block(source, item, given) for item in top.tables("block"))
    if not blocks:
        raise SpecError(f"{source}: block: expected at least one [[block]]")
    _refuse_shared_axes(source, blocks)
    return Spec(rate_hz=rate, delay_samples=delay, gamma_backoff=backoff, blocks=blocks, source=source)


def _refuse_shared_axes(source: str, blocks: tuple[BlockSpec, ...]) -> None:
    owner: dict[str, str] = {}
    for block in blocks:
        for axis in block.axes:
            if axis in owner:
                raise SpecError(
                    f"{source}: block {block.name!r}: axes: {axis!r} already belongs to block {owner[axis]!r}"
                )
            owner[axis] = block.name


def _backoff(table: Table, default: float) -> float:
    return table.number("gamma_backoff", lambda x: 1.0 < x <= 10.0, "a number above 1, at most 10", default)


def _order(table: Table, default: int | None) -> int | None:
    """`largest_order`, the number of states that an observer may have; None for as many as it takes."""
    if "largest_order" not in table:
        return default
    order = table.whole("largest_order", 0)
    if order == 0:
        raise SpecError(f"{table.where}: largest_order: expected a whole number of 1 or more, got 0")
    return order


@dataclass(frozen=True, slots=True)
class _Given:
    """What [design] and [auto] say for all blocks."""

    rate: float
    delay: int
    order: int | None
    backoff: float
    auto: Table | None


def _block(source: str, item: object, given: _Given) -> BlockSpec:
    keys = (
        *("name", "axes", "delay_samples", "gamma_backoff", "largest_order", "largest_disturbance"),
        *("plant", "controller", "weights", "uncertainty", "auto"),
    )
    table = Table(f"{source}: block", item, keys)
    name = table.text("name")
    table = Table(f"{source}: block {name!r}", item, keys)
    axes = table.texts("axes")
    if not axes or len(set(axes)) != len(axes) or not set(axes) <= set(AXES):
        raise SpecError(f"{table.where}: axes: expected different ones of {', '.join(AXES)}, got {shown(list(axes))}")
    auto = _auto(table, given)
    disturbance, noise = _weights(table, axes) if auto is None or "weights" in table else (None, None)
    return BlockSpec(
        where=table.where,
        name=name,
        axes=axes,
        delay_samples=table.whole("delay_samples", given.delay, LONGEST_DELAY),
        plant=_model(table.open("plant"), axes),
        controller=_model(table.open("controller"), axes),
        disturbance=disturbance,
        noise=noise,
        uncertainty=parse_uncertainty(table.open("uncertainty"), axes) if "uncertainty" in table else None,
        largest_order=_order(table, given.order),
        gamma_backoff=_backoff(table, given.backoff),
        largest_disturbance=_largest_disturbance(table),
        auto=auto,
    )


def _auto(block: Table, given: _Given) -> AutoSpec | None:
    """[auto] with the block's own keys in it; it must be complete only where a block needs it."""
    if "auto" in block:
        own = block.open("auto")
        return parse_auto(own if given.auto is None else overridden(given.auto, own), given.rate)
    return None if given.auto is None else parse_auto(given.auto, given.rate)


def _largest_disturbance(table: Table) -> float | None:
    """Of any axis of the block, normalized torque; None where the spec does not say."""
    if "largest_disturbance" not in table:
        return None
    return table.number("largest_disturbance", lambda x: 0.0 < x <= 1.0, "a number above 0, at most 1")


def _weights(block: Table, axes: tuple[str, ...]) -> tuple[Weight, Weight]:
    weights = block.table("weights", ("disturbance", "noise"))
    return _weight(weights.open("disturbance"), axes), _weight(weights.open("noise"), axes)


def _weight(table: Table, axes: tuple[str, ...]) -> Weight:
    table.expect((*_MODEL_KEYS, *axes))
    own = tuple((i, _model(table.open(axis), (axis,))) for i, axis in enumerate(axes) if axis in table)
    bare = table.without(axes)
    common = _model(bare, axes) if len(bare) else None
    if common is None and len(own) < len(axes):
        missing = [axis for axis in axes if axis not in table]
        raise SpecError(f"{table.where}: no weight for {', '.join(missing)}: give one for all, or one each")
    return Weight(table.where, common, own)


def _model(table: Table, axes: tuple[str, ...]) -> Model:
    if "entry" in table:
        table.expect(("entry", *_TIME_KEYS))
        items = tuple(_entry(table, item, axes) for item in table.tables("entry"))
        seen = [(to, source) for to, source, _ in items]
        if len(set(seen)) != len(seen):
            raise SpecError(f"{table.where}: entry: the same from and to were given twice")
        return Model(Entries(len(axes), items), table.where)
    table.expect(_MODEL_KEYS)
    return Model(_form(table), table.where, *_time_domain(table))


def _entry(parent: Table, item: object, axes: tuple[str, ...]) -> tuple[int, int, Model]:
    time_domain = _time_domain(parent)
    table = Table(f"{parent.where}: entry", item, ("from", "to", *FORMS["zpk"], *FORMS["polynomial"]))
    ends = [table.text(key) for key in ("to", "from")]
    for key, axis in zip(("to", "from"), ends, strict=True):
        if axis not in axes:
            raise SpecError(f"{table.where}: {key}: {axis!r} is not one of this block's axes {list(axes)}")
    where = f"{parent.where}: entry {ends[1]} -> {ends[0]}"
    form = _form(Table(where, item, table.known))
    return axes.index(ends[0]), axes.index(ends[1]), Model(form, where, *time_domain)


def _time_domain(table: Table) -> tuple[str, str, float]:
    domain = table.choice("domain", ("z", "s"), "z")
    for key in ("method", "delay_s"):
        if domain == "z" and key in table:
            raise SpecError(f'{table.where}: {key}: only a model with domain = "s" is discretized')
    method = table.choice("method", METHODS, "zoh")
    if "delay_s" not in table:
        return domain, method, 0.0
    if method != "zoh":
        raise SpecError(f'{table.where}: delay_s: expected method = "zoh", the one that takes a delay, got {method!r}')
    return domain, method, table.number("delay_s", lambda x: 0.0 <= x <= 1e3, "a number of seconds, 0 or more")


def _form(table: Table) -> Zpk | Polynomial | Matrices:
    begun = [name for name, keys in FORMS.items() if any(key in table for key in keys)]
    if len(begun) != 1:
        raise SpecError(f"{table.where}: expected one of zeros, poles, gain | num, den | A, B, C, D")
    make: dict[str, Callable[[Table], Zpk | Polynomial | Matrices]] = {
        "zpk": _zpk,
        "polynomial": _polynomial,
        "matrices": _matrices,
    }
    return make[begun[0]](table)


def _zpk(table: Table) -> Zpk:
    zeros, poles = _roots(table, "zeros"), _roots(table, "poles")
    if len(zeros) > len(poles):
        raise SpecError(f"{table.where}: zeros: {len(zeros)} of them but {len(poles)} poles: not causal")
    return Zpk(zeros, poles, table.number("gain"))


def _roots(table: Table, key: str) -> tuple[complex, ...]:
    """Real roots as they are; [re, im] gives the conjugate pair."""
    out: list[complex] = []
    for item in table.items(key):
        pair = [item, 0.0] if not isinstance(item, list) else item
        if len(pair) != 2 or not all(is_number(part) for part in pair):
            raise SpecError(f"{table.where}: {key}: expected finite numbers or [re, im] pairs, got {shown(item)}")
        root = complex(float(pair[0]), float(pair[1]))
        out += [root, root.conjugate()] if root.imag else [root]
    return tuple(out)


def _polynomial(table: Table) -> Polynomial:
    num, den = table.numbers("num"), table.numbers("den")
    if not den or den[0] == 0.0:
        raise SpecError(f"{table.where}: den: expected a leading coefficient that is not 0")
    if len(num) > len(den):
        raise SpecError(f"{table.where}: num: degree {len(num) - 1} above den's {len(den) - 1}: not causal")
    return Polynomial(num or (0.0,), den)


def _matrices(table: Table) -> Matrices:
    return Matrices(*(table.matrix(key) for key in FORMS["matrices"]))
