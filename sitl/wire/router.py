"""Which messages pass from one link to the other. Pure rules, no state but who was heard where."""

from sitl.wire.port import SYSTEM, Message

UNTARGETED = frozenset(
    ("HEARTBEAT", "STATUSTEXT", "PARAM_VALUE", "PARAM_ERROR", "ONBOARD_COMPUTER_STATUS", "DEBUG_FLOAT_ARRAY")
)
"""Forwarded although (or whether or not) they name a target."""

NEVER = frozenset(("TIMESYNC", "DEBUG_VECT", "SET_ACTUATOR_CONTROL_TARGET", "TUNNEL"))
"""The link's own clock exchange, and the carriers of a correction."""


def passes(message: Message, heard_there: set[tuple[int, int]]) -> bool:
    """Whether `message` goes on to the link on which the (system, component) pairs `heard_there` live."""
    kind = message.get_type()
    if kind in NEVER:
        return False
    if kind in UNTARGETED:
        return True
    system = getattr(message, "target_system", None)
    if system is None:
        return False
    component = getattr(message, "target_component", 0)
    if system == 0:
        return True
    if component == 0:
        return system == SYSTEM or any(s == system for s, _ in heard_there)
    return (system, component) in heard_there


def is_for_vehicle(message: Message, component: int) -> bool:
    """Whether a targeted message means the vehicle itself: by name, or by 0 for all."""
    return getattr(message, "target_system", 0) in (0, SYSTEM) and getattr(message, "target_component", 0) in (
        0,
        component,
    )
