"""What a certificate says of the attenuation, as people read it."""

from dataclasses import dataclass

from dob_companion.artifact import DobBlock
from dob_companion.synthesis.optimal.reached import recorded_weather


@dataclass(frozen=True, slots=True)
class Attained:
    """RMS attitude error without the observer over that with it, of one block.

    weather     in words
    reached     by this observer, the plant as modelled
    at_gains    (gain, attenuation) at other gains of the plant; None where a loop is unstable
    limit       no observer within the limits in `at` has more; None where that is not known, for the reason `absent`
    at          those limits in words
    """

    weather: str
    reached: float
    at_gains: tuple[tuple[float, float | None], ...]
    limit: float | None
    at: str
    absent: str

    @property
    def share(self) -> float | None:
        """Of the limit."""
        return self.reached / self.limit if self.limit else None


def attained(block: DobBlock, dt: float) -> Attained | None:
    """From the certificate; None where it says nothing of it, or nothing that can be read."""
    extra = block.certificate.extra
    reached, limit, at = (extra.get(name) for name in ("attenuation", "attenuation_limit", "attenuation_limit_at"))
    auto = recorded_weather(extra, dt, f"block {block.name!r}: certificate")
    if auto is None or not _is_number(reached):
        return None
    gains = extra.get("attenuation_at_gains")
    return Attained(
        weather=auto.disturbances,
        reached=float(reached),  # type: ignore[arg-type]
        at_gains=tuple((float(g), v) for g, v in gains.items()) if isinstance(gains, dict) else (),
        limit=float(limit) if _is_number(limit) else None,  # type: ignore[arg-type]
        at=_limits(at) if isinstance(at, dict) else "",
        absent=str(extra.get("attenuation_limit_absent", "")),
    )


def attained_words(block: DobBlock, dt: float) -> str:
    """One or two sentences; empty where nothing is known."""
    found = attained(block, dt)
    if found is None:
        return ""
    head = f"{block.name}: with {found.weather} the attitude error is {found.reached:.3g} times smaller."
    return " ".join(filter(None, (head, limit_words(found), gain_words(found))))


def limit_words(found: Attained) -> str:
    """What could be had, in a sentence."""
    if found.limit is None:
        return f"The most that any observer reaches is {found.absent}." if found.absent else ""
    share = 100.0 * found.reached / found.limit
    return (
        f"No observer with {found.at}, whatever its order and delay margin, makes it more than {found.limit:.3g} times "
        f"smaller: {share:.0f} % of that."
    )


def gain_words(found: Attained) -> str:
    """What becomes of it at other gains of the plant."""
    told = [
        f"{g:g} of the model's {'a loop is unstable' if v is None else f'{v:.3g} times'}" for g, v in found.at_gains
    ]
    return f"With the plant's gain at {', at '.join(told)}." if told else ""


def _limits(at: dict[str, float]) -> str:
    words = [f"a disk margin of {at['disk_margin']:.3g}", f"noise in the correction of at most {at['noise']:.3g}"]
    if "noise_gain" in at:
        words.append(f"a noise gain of at most {at['noise_gain']:.3g}")
    return ", ".join(words[:-1]) + f" and {words[-1]}"


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
