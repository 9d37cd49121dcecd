"""The room that touches disk: reading what people wrote, and writing so that nothing is ever half there."""

from dob_companion.files.atomic import (
    make_directory,
    read_bytes,
    read_text,
    reader_beside,
    remove,
    require_place,
    write_bytes,
    write_files,
    write_text,
)
from dob_companion.files.background_writer import BackgroundWriter
from dob_companion.files.parameter_keeper import ParameterKeeper, recover_parameters

__all__ = [
    "BackgroundWriter",
    "ParameterKeeper",
    "make_directory",
    "read_bytes",
    "read_text",
    "reader_beside",
    "recover_parameters",
    "remove",
    "require_place",
    "write_bytes",
    "write_files",
    "write_text",
]
