"""What flies: a body in the air behind a small protocol, its rotors, and what may become of it.

It knows no controller: `sitl.autopilot.aircraft` fits one to it.
"""
