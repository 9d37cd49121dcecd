"""A design flown in simulation over the family of plants that it is meant for, before it flies."""

from dob_companion.rehearsal.flights import Rehearsal, rehearse
from dob_companion.rehearsal.verdict import Outcome, rehearsal_object, rehearsal_table

__all__ = ["Outcome", "Rehearsal", "rehearsal_object", "rehearsal_table", "rehearse"]
