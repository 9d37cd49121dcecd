"""The observer as it flies, the design's own model of the gyro beside it, and what may be missing between samples or
between readings of the moment."""

from dob_companion.observer.bank import ObserverBank
from dob_companion.observer.missing import Missing, missing_samples
from dob_companion.observer.model import GyroModel
from dob_companion.observer.readings import MISREAD, misread_by
from dob_companion.observer.strong_wind import StrongWind

__all__ = ["MISREAD", "GyroModel", "Missing", "ObserverBank", "StrongWind", "misread_by", "missing_samples"]
