"""Norms by proof: brackets of a gain over the whole unit circle, and of the structured singular value."""
