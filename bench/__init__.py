"""Measurements. Each module here has `measure()`, which returns the lines of its table."""
