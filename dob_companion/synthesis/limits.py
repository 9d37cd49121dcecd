"""How large a problem may be: what is larger would take hours and all memory, and is refused before it begins."""

LONGEST_DELAY = 50
"""Samples of delay that a link or an uncertainty may have: as far as delay margins are looked for."""

MOST_STATES = 60
"""Order of plant, weights and link delay together, and of the controller: time grows with its fourth power."""

MOST_DELAY_CASES = 300
"""Combinations of the axes' uncertain delays."""
