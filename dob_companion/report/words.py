"""Numbers as people read them: with units, a true minus sign and no more digits than mean something."""

import math
from collections.abc import Iterable


def number(value: float | None, digits: int = 3, unit: str = "") -> str:
    """`value` to so many significant digits; NaN and None are a dash, infinity a word."""
    if value is None or math.isnan(value):
        return "–"
    if math.isinf(value):
        return "unlimited" if value > 0 else "−unlimited"
    size = abs(value)
    if size and not 1e-4 <= size < 1e6:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        text = f"{mantissa}\u00a0·\u00a010{_raised(int(exponent))}"
    else:
        places = max(digits - 1 - math.floor(math.log10(size)), 0) if size else 0
        text = f"{value:.{places}f}"
    return (text + (f"\u00a0{unit}" if unit else "")).replace("-", "−")


def plural(count: int, word: str) -> str:
    """`1 state`, `4 states`."""
    return f"{count} {word}" if count == 1 else f"{count} {word}s"


def listed(words: tuple[str, ...]) -> str:
    """`roll`, `roll and pitch`, `roll, pitch and yaw`."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def transfer_function(zeros: Iterable[complex], poles: Iterable[complex], gain: float) -> str:
    """`0.14131 (z + 1.716) / ((z − 1)(z − 0.9447))`, a conjugate pair as one quadratic; five significant digits."""
    above, below = _factors(zeros), _factors(poles)
    head = f"{gain:.5g}".replace("-", "−")
    top = " ".join([head, "".join(above)]) if above else head
    if not below:
        return top
    return f"{top} / {below[0]}" if len(below) == 1 else f"{top} / ({''.join(below)})"


def _factors(roots: Iterable[complex]) -> list[str]:
    texts = []
    for root in sorted(roots, key=lambda r: (-r.real, r.imag)):
        if abs(root) < 1e-9:
            texts.append("z")
        elif abs(root.imag) < 1e-9:
            texts.append(f"(z {_signed(-root.real)})")
        elif root.imag > 0.0:
            texts.append(f"(z² {_signed(-2.0 * root.real)} z {_signed(abs(root) ** 2)})")
    return texts


def _signed(value: float) -> str:
    return f"{'−' if value < 0 else '+'} {abs(value):.5g}"


def _raised(exponent: int) -> str:
    return str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
