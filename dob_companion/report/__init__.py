"""Pages and pictures that people look at: a design's, a flight's. Draws values; has no maths of its own."""
