"""What `excite` leaves beside its log: what the log's frames do not tell of the autopilot and the link."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dob_companion.autopilots import Sourced
from dob_companion.cli.exciting import RESULT, SCHEMA
from dob_companion.errors import InputError
from dob_companion.files import read_text
from dob_companion.identification.controllers import Controllers
from dob_companion.synthesis.spec.limits import LONGEST_DELAY


@dataclass(frozen=True, slots=True, kw_only=True)
class Excited:
    """parameters  of the autopilot
    delay       samples that 95 % of the corrections were late, with the median in words; None where not measured
    """

    parameters: dict[str, float]
    delay: Sourced | None


def beside(log: Path) -> Excited | None:
    """Of this log; None where there is none of it. Raises InputError, one line, for a file that is damaged."""
    path = log.parent / RESULT
    if not path.exists():
        return None
    try:
        content = json.loads(read_text(path))
        if content["schema"] != SCHEMA:
            raise ValueError
        if content["log"] != log.name:
            return None
        parameters = {str(name): float(value) for name, value in content["parameters"].items()}
        return Excited(parameters=parameters, delay=_delay(content.get("delay")))
    except (ValueError, TypeError, KeyError, AttributeError):
        raise InputError(f'{path}: expected what `dob-companion excite` writes, schema "{SCHEMA}"') from None


def _delay(said: dict[str, Any] | None) -> Sourced | None:
    if said is None or said["p95_samples"] is None:
        return None
    late, median = int(said["p95_samples"]), int(said["median_samples"])
    if not 0 <= median <= late <= LONGEST_DELAY:
        return None
    return Sourced(
        max(1, late), f"measured while it was excited: 95 % within {late}, median {median}; {said['source']}"
    )


def link_delay(given: int | None, measured: Sourced | None, controllers: Controllers) -> Sourced:
    """`delay_samples` of a design: what was given, else what was measured but no less than the autopilot needs with an
    observer's work to do, else what is known beforehand."""
    if given is not None:
        return Sourced(given, "given")
    if measured is None:
        return controllers.delay_samples
    least = controllers.least_delay
    if measured.value >= least:
        return measured
    return Sourced(least, f"least for this autopilot; {measured.source}")
