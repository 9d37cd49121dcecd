"""Times as JSON carries them."""

from datetime import UTC, datetime


def utc() -> str:
    """This computer's time: RFC 3339, UTC, to the millisecond."""
    return datetime.now(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
