"""Other observers on the same plant, link and weather; never on an aircraft.

    from dob_companion.comparison import compare

    for axis in compare(design, seeds=20, source="spec.toml"):
        axis.best.name, axis.best.mean

One file per method (`conventional`, `open_loop`, `kalman`, `eso`, `indi`), each opening with its source. All are linear
discrete observers D(z): [y_n; u_e] -> d_hat as python-control StateSpace, so that `vehicle` (the loop), `flight` (the
weather), `measure` (margins) and `tuning` (the common rule) serve every one of them.
"""

from dob_companion.comparison.evaluate import OFF_NOMINAL, AxisComparison, Row, compare
from dob_companion.comparison.table import comparison_object, comparison_table

__all__ = ["OFF_NOMINAL", "AxisComparison", "Row", "compare", "comparison_object", "comparison_table"]
