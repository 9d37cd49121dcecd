"""Link URLs, in our words and in those of other programs."""

import pytest

from dob_companion.errors import LinkUrlError
from dob_companion.runtime import LinkUrl, parse_link_url

TTY = "/dev/ttyACM0"
BY_PATH = "/dev/serial/by-path/pci-0000:00:14.0-usb-0:1:1.0"


@pytest.mark.parametrize(
    ("text", "url"),
    [
        ("udpin:127.0.0.1:14540", LinkUrl("udpin", "127.0.0.1", 14540)),
        ("udpout://192.168.1.2:14550", LinkUrl("udpout", "192.168.1.2", 14550)),
        ("tcp:localhost:5760", LinkUrl("tcp", "localhost", 5760)),
        ("serial:/dev/ttyAMA0:921600", LinkUrl("serial", "/dev/ttyAMA0", 921600)),
        ("serial:///dev/ttyUSB0:57600", LinkUrl("serial", "/dev/ttyUSB0", 57600)),
        ("udpin:[::1]:14540", LinkUrl("udpin", "::1", 14540)),
    ],
)
def test_a_url_is_read_in_both_spellings_and_printed_as_it_is_read(text, url):
    assert parse_link_url(text) == url
    assert parse_link_url(str(url)) == url


@pytest.mark.parametrize(
    ("text", "url"),
    [
        # MAVProxy's --master, pymavlink
        ("/dev/ttyACM0", LinkUrl("serial", TTY, 921600)),
        ("/dev/ttyACM0,57600", LinkUrl("serial", TTY, 57600)),
        ("/dev/ttyACM0:57600", LinkUrl("serial", TTY, 57600)),
        ("udp:127.0.0.1:14550", LinkUrl("udpin", "127.0.0.1", 14550)),
        ("127.0.0.1:14550", LinkUrl("udpin", "127.0.0.1", 14550)),
        ("0.0.0.0:14550", LinkUrl("udpin", "0.0.0.0", 14550)),
        ("udp:14550", LinkUrl("udpin", "127.0.0.1", 14550)),
        ("UDPIN:0.0.0.0:14550", LinkUrl("udpin", "0.0.0.0", 14550)),
        # MAVSDK
        ("udp://:14550", LinkUrl("udpin", "127.0.0.1", 14550)),
        ("udpin://0.0.0.0:14540", LinkUrl("udpin", "0.0.0.0", 14540)),
        ("tcpout://127.0.0.1:5760", LinkUrl("tcp", "127.0.0.1", 5760)),
        ("tcp://:5760", LinkUrl("tcp", "127.0.0.1", 5760)),
        ("udpin://0.0.0.0:14540/", LinkUrl("udpin", "0.0.0.0", 14540)),
        ("serial:///dev/ttyACM0", LinkUrl("serial", TTY, 921600)),
        # QGroundControl shows a port and a device without its directory
        ("14550", LinkUrl("udpin", "127.0.0.1", 14550)),
        ("ttyACM0", LinkUrl("serial", TTY, 921600)),
        ("ttyACM0:57600", LinkUrl("serial", TTY, 57600)),
        ("serial:ttyACM0:57600", LinkUrl("serial", TTY, 57600)),
        ("serial0", LinkUrl("serial", "/dev/serial0", 921600)),
        # names that hold colons
        (BY_PATH, LinkUrl("serial", BY_PATH, 921600)),
        (f"serial:{BY_PATH}:57600", LinkUrl("serial", BY_PATH, 57600)),
        (f"{BY_PATH}-port0,57600", LinkUrl("serial", f"{BY_PATH}-port0", 57600)),
        # no port
        ("udpin:0.0.0.0", LinkUrl("udpin", "0.0.0.0", 14540)),
        ("udpin:[::1]", LinkUrl("udpin", "::1", 14540)),
        ("tcp:vehicle.local", LinkUrl("tcp", "vehicle.local", 5760)),
    ],
)
def test_what_users_of_other_programs_type_first_is_understood(text, url):
    assert parse_link_url(text) == url


def test_what_is_left_out_comes_from_the_command():
    assert parse_link_url("udpin:0.0.0.0", udp_port=14550) == LinkUrl("udpin", "0.0.0.0", 14550)
    assert parse_link_url("/dev/ttyUSB0", baud=57600) == LinkUrl("serial", "/dev/ttyUSB0", 57600)


@pytest.mark.parametrize("text", ["udp:14550", "udp://:14550", "14550", ":14550", "udpin::14550"])
def test_nothing_listens_off_loopback_unless_a_url_says_so(text):
    assert parse_link_url(text).target == "127.0.0.1"


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("", "expected udpin:HOST:PORT"),
        ("udpin", "expected udpin:HOST:PORT"),
        ("udpin:", "expected udpin:HOST:PORT"),
        ("udpin::", "expected udpin:HOST:PORT"),
        ("serial:", "serial:DEVICE:BAUD"),
        ("COM3", "serial:DEVICE:BAUD"),
        ("http://localhost:80", "expected udpin:HOST:PORT"),
        ("tcp:host:0", "'0' is not a port"),
        ("tcp:host:70000", "'70000' is not a port"),
        ("udpin:host:", "'' is not a port"),
        ("udpin:127.0.0.1:14540:1", "not one host"),
        ("udp://:14540@127.0.0.1:14557", "not one host"),  # MAVROS
        ("tcpin:0.0.0.0:5760", "listening for TCP is not supported"),
        ("serial:/dev/tty:fast", "'fast' is not a baud rate"),
        ("/dev/ttyACM0,", "'' is not a baud rate"),
        ("/dev/ttyACM0,9999999", "'9999999' is not a baud rate"),
    ],
)
def test_a_bad_url_is_one_line_that_says_what_was_expected(text, word):
    with pytest.raises(LinkUrlError) as caught:
        parse_link_url(text)
    assert repr(text) in str(caught.value)
    assert word in str(caught.value)
    assert "\n" not in str(caught.value)
