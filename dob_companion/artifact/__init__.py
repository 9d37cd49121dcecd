"""The one file in which the two wings meet: `design.json`, its types, its text form, its fitness to fly."""

from dob_companion.artifact.codec import SCHEMA, dumps, loads, sha256_of
from dob_companion.artifact.design import AXES, LARGEST_DISTURBANCE, Certificate, DobBlock, DobDesign, Problem
from dob_companion.artifact.flyable import check_flyable
from dob_companion.artifact.words import certificate_object, certificate_table, design_table
from dob_companion.lti.statespace import StateSpaceData

__all__ = [
    "AXES",
    "LARGEST_DISTURBANCE",
    "SCHEMA",
    "Certificate",
    "DobBlock",
    "DobDesign",
    "Problem",
    "StateSpaceData",
    "certificate_object",
    "certificate_table",
    "check_flyable",
    "design_table",
    "dumps",
    "loads",
    "sha256_of",
]
