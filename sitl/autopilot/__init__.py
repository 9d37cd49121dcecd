"""What an autopilot does: sensors, attitude and rate control, holds, mixer, and taking up corrections. Pure."""
