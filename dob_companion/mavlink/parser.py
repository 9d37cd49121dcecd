"""pymavlink's parser as we use it: robust, and with a memory that does not grow."""

from typing import Any

from pymavlink.dialects.v20 import common as mav

MOST_PARSED = 4096
"""Bytes already parsed that are kept at most."""


def robust_parser() -> Any:
    """A parser that takes garbage for garbage and goes on."""
    parser = mav.MAVLink(None)
    parser.robust_parsing = True
    return parser


def forget_parsed(parser: Any) -> None:
    """Drop what has been parsed. pymavlink does so only when a piece happens to end with a message: on a stream whose
    pieces never do, it would keep all that ever came."""
    if parser.buf_index > MOST_PARSED:
        del parser.buf[: parser.buf_index]
        parser.buf_index = 0
