"""The main job in one go: design, two processes on a link, a switch in mid-flight, and what came of it."""

from dob_companion.demo.director import Demo, fly, fly_demo

__all__ = ["Demo", "fly", "fly_demo"]
