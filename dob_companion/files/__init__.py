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
from dob_companion.files.latest import LatestWriter
from dob_companion.files.settings import SettingsKeeper, recover_settings

__all__ = [
    "LatestWriter",
    "SettingsKeeper",
    "make_directory",
    "read_bytes",
    "read_text",
    "reader_beside",
    "recover_settings",
    "remove",
    "require_place",
    "write_bytes",
    "write_files",
    "write_text",
]
