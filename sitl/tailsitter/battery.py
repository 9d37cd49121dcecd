"""A lithium battery: open-circuit voltage linear in charge, one internal resistance.

Limits: no relaxation, no temperature; the voltage acts on top speed in proportion, as for motors without speed control.
"""

from math import sqrt
from typing import Any

from sitl.tailsitter.compiled import compiled


@compiled
def battery(charge: float, shaft_power: float, p: Any) -> tuple[float, float]:
    """Voltage under load over that of a full battery at rest, and the current drawn, A.

    The current solves V I = P / η with V = V_oc − R I; beyond the greatest power there is, V is half of V_oc.
    """
    full = p["cells"] * p["cell_full"]
    empty = p["cells"] * p["cell_empty"]
    open_circuit = empty + (full - empty) * min(1.0, max(0.0, charge))
    power = max(shaft_power, 0.0) / p["drive_efficiency"]
    root = open_circuit * open_circuit - 4.0 * p["battery_resistance"] * power
    voltage = 0.5 * (open_circuit + sqrt(max(root, 0.0)))
    return voltage / full, power / voltage
