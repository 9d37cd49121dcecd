"""Ctrl-C in the midst of an import, which packages make something else of, or nothing at all."""

import signal
import subprocess
import sys

import pytest

PACKAGE = """
import os, signal
try:
    os.kill(os.getpid(), signal.SIGINT)
    print("not disturbed")
except BaseException:
    print("swallowed")
"""

PROGRAM = """
import time
from dob_companion.cli.interrupt import hold_ctrl_c_in_imports
{hold}
try:
    import greedy
    time.sleep(60.0)
except KeyboardInterrupt:
    print("interrupted")
"""


@pytest.mark.parametrize("hold", [True, False])
def test_it_is_met_when_the_import_is_over(tmp_path, hold):
    (tmp_path / "greedy.py").write_text(PACKAGE)
    program = PROGRAM.format(hold="hold_ctrl_c_in_imports()" if hold else "").replace("60.0", "60.0" if hold else "0.0")
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.stdout.split("\n")[:-1] == (["not disturbed", "interrupted"] if hold else ["swallowed"])


def test_who_ignores_it_goes_on_ignoring_it():
    program = (
        "import signal; from dob_companion.cli.interrupt import hold_ctrl_c_in_imports; "
        "signal.signal(signal.SIGINT, signal.SIG_IGN); hold_ctrl_c_in_imports(); "
        "print(signal.getsignal(signal.SIGINT).name)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.stdout.strip() == signal.SIG_IGN.name
