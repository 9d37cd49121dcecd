"""Weights found for a pilot's wishes instead of given."""
