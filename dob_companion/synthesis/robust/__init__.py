"""Uncertain plants: what an observer is worth for every one of them, and observers worth the most."""
