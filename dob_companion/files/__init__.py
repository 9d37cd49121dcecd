"""The room that touches disk: reading what people wrote, and writing so that nothing is ever half there."""

from dob_companion.files.atomic import make_directory, read_bytes, read_text, write_bytes, write_text

__all__ = ["make_directory", "read_bytes", "read_text", "write_bytes", "write_text"]
