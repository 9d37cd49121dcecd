"""Design a certified disturbance observer offline; fly it from a companion computer over MAVLink."""

__version__ = "0.1.0"
