"""What surrounds the vehicle: disturbance, wind and gusts. Pure."""
