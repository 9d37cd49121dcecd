"""The result as a table for the terminal."""

from typing import Any


def result_table(result: dict[str, Any], designed_delay: int) -> str:
    """Axis; peak and RMS attitude error off and on; ratios beside the paper's; then what the link did."""
    head = (
        f"{'':7}{'peak attitude error, rad':^30}{'RMS attitude error, rad':^28}\n"
        f"{'axis':7}{'off':>8}{'on':>9}{'off/on':>8}{'paper':>7}{'off':>10}{'on':>9}{'off/on':>8}"
    )
    rows = [
        f"{name:7}{a['peak_off']:>8.4f}{a['peak_on']:>9.4f}{a['peak_ratio']:>8.1f}{a['paper_ratio']:>7g}"
        f"{a['rms_off']:>10.5f}{a['rms_on']:>9.5f}{a['rms_ratio']:>8.1f}"
        for name, a in result["axes"].items()
    ]
    link = (
        f"delay {result['delay_samples']} samples measured, {designed_delay} designed for;  "
        f"{result['rate_hz']:.2f} Hz;  {result['samples_lost']} of {result['samples']} samples lost;  "
        f"seed {result['seed']}, {result['clock']} clock"
    )
    return "\n".join((head, *rows, link))
