"""The vehicle's MAVLink side, pure: bytes and time come in as arguments, bytes go out when asked for."""
