"""Which of several sources of body rates and moments is taken."""

from collections.abc import Sequence
from typing import NamedTuple

from dob_companion.logs.series import Series

_EQUAL = 0.9
"""Rates that differ by less than this ratio count as equal."""


class Source(NamedTuple):
    """A signal that there is; `words` say where it comes from, `filtered` whether it has passed the gyro filter."""

    words: str
    series: Series
    filtered: bool | None = None


def chosen(rates: Sequence[Source], moments: Sequence[Source], link: bool) -> tuple[Source, Source, str]:
    """The pair with the highest rate that both have; of equal ones the rates that are filtered as the link's are
    (`link`), then those named first. And what to say of the choice."""
    moment = max(moments, key=lambda source: source.series.rate_hz)
    moment = next(m for m in moments if m.series.rate_hz >= _EQUAL * moment.series.rate_hz)
    common = [min(source.series.rate_hz, moment.series.rate_hz) for source in rates]
    best = [source for source, hz in zip(rates, common, strict=True) if hz >= _EQUAL * max(common)]
    taken = next((source for source in best if source.filtered is link), best[0])
    words = f"rates from {_described(taken)}, moment from {_described(moment)}"
    others = [_described(source) for source in (*rates, *moments) if source is not taken and source is not moment]
    return taken, moment, words + (f" (there are also {', '.join(others)})" if others else "")


def _described(source: Source) -> str:
    return f"{source.words} at {source.series.rate_hz:.3g} Hz"
