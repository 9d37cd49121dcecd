"""The log of a daemon, into whatever its outputs are."""

import subprocess
import sys

import pytest

SPEAKS = "from dob_companion.view.outlet import Outlet; o = Outlet({fd}); o.send(b'a line\\n'); o.close()"


@pytest.mark.parametrize(("fd", "name"), [(1, "stdout"), (2, "stderr")])
def test_a_file_in_the_place_of_an_output_gets_every_line(tmp_path, fd, name):
    path = tmp_path / "log"
    with path.open("w") as log:
        subprocess.run([sys.executable, "-c", SPEAKS.format(fd=fd)], check=True, timeout=60, **{name: log})
    assert path.read_text() == "a line\n"
