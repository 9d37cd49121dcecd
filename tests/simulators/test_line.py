"""The serial line that the simulators are flown on carries bytes both ways, whatever they are."""

import os
import select

import pytest

from tests.simulators.line import line


@pytest.mark.parametrize("way", [1, -1])
def test_every_byte_comes_out_of_the_other_end(way):
    said = bytes(range(256)) * 4
    with line() as devices:
        here, there = (os.open(device, os.O_RDWR | os.O_NOCTTY) for device in devices[::way])
        os.write(here, said)
        heard = b""
        while len(heard) < len(said) and select.select([there], [], [], 60.0)[0]:
            heard += os.read(there, 4096)
        os.close(here)
        os.close(there)
    assert heard == said
