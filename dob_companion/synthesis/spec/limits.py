"""How large a problem may be: what is larger would take hours and all memory, and is refused before it begins."""

LONGEST_DELAY = 30
"""Samples of delay that a link or an uncertainty may have, 0.12 s at 250 Hz."""

MOST_STATES = 40
"""Order of plant, weights and link delay together, and of the controller. Time and memory of the LMI grow with its
fourth power, to about half a minute and 1 GB here."""

MOST_DELAY_CASES = 300
"""Combinations of the axes' uncertain delays."""
