"""gamma_star between proven bounds, and the observers near it: Riccati equation, LMI and its dual."""
