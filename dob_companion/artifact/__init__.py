"""The one file in which the two wings meet: `design.json`, its types, its text form, its fitness to fly."""

from dob_companion.artifact.codec import SCHEMA, dumps, loads, sha256_of
from dob_companion.artifact.design import AXES, Certificate, DobBlock, DobDesign, Problem
from dob_companion.artifact.flyable import check_flyable
from dob_companion.lti.statespace import StateSpaceData

__all__ = [
    "AXES",
    "SCHEMA",
    "Certificate",
    "DobBlock",
    "DobDesign",
    "Problem",
    "StateSpaceData",
    "check_flyable",
    "dumps",
    "loads",
    "sha256_of",
]
