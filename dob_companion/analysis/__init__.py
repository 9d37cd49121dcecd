"""Values of what is over or designed, from which pages are drawn: a recorded flight, the blocks of a design. Pure."""
