"""The colours of every figure: a role has one colour everywhere, told apart by any eye and in grey print.

Vermilion, blue and amber are of Okabe and Ito's colour-blind-safe set ("Color universal design", 2008); purple is
theirs darkened, so that a thin line shows on white.
"""

INK = "#2b2b2b"
MUTED = "#666666"
RULE = "#e4e4e4"
PAPER = "#ffffff"

COLOURS = {
    "off": "#d55e00",  # the loop without the observer
    "on": "#0072b2",  # the loop with it, and what the observer computes
    "truth": "#e69f00",  # the true disturbance, the true plant; drawn wide, since it is light
    "extra": "#8a4f7d",  # a second product of the observer in the same figure, such as Q
    "weight": "#8a4f7d",  # what the design asked for: same colour as Q, never beside it
    "bound": "#a8a8a8",  # weights and limits
}
