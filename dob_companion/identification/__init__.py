"""From what was seen of an aircraft to a model of it, with its uncertainty. Pure: numpy and scipy, no file, no link."""
