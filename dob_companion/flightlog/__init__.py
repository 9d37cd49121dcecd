"""A flight kept and read back: the companion's state as text, flown again from the recording, and what it did."""
