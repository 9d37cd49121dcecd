"""Exciting a hovering aircraft on the moment, within limits, and never beside a correction. Pure."""
