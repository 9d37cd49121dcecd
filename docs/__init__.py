"""Documentation, and what prints parts of it."""
