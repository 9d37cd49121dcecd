"""What a look at a link finds: one line, and what it means for flying."""

from dataclasses import dataclass
from enum import Enum


class Verdict(Enum):
    """What a finding means for flying."""

    OK = "ok"
    NOTE = "note"
    MISSING = "missing"


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of the report; `remedy` is "" where nothing needs to be done."""

    verdict: Verdict
    topic: str
    text: str
    remedy: str = ""
