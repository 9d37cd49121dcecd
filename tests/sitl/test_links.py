"""Link URLs, sockets, and the schedule of real time."""

import itertools
import re
import socket

import pytest

from sitl.errors import LinkBusyError, LinkUrlError
from sitl.links import Link, open_link, other_end, parse_url, wait
from sitl.pace import CATCH_UP, Pace
from tests.cli.processes import PATIENCE_S
from tests.ports import free_port

DT = 0.004
MANY = 10_000
"""Kilobytes: more than the kernel keeps for a client that does not read."""


def receive(link: Link) -> bytes:
    data = b""
    while not data:
        data = b"".join(d for _, d in wait({"it": link}, 5.0))
    return data


@pytest.mark.parametrize("slashes", ["", "//"])
@pytest.mark.parametrize("scheme", ["udpin", "udpout", "tcp"])
def test_both_spellings_of_a_link_are_read(scheme, slashes):
    assert parse_url(f"{scheme}:{slashes}127.0.0.1:14540") == (scheme, "127.0.0.1", 14540)
    assert parse_url(f"{scheme}:{slashes}[::1]:14540") == (scheme, "::1", 14540)


@pytest.mark.parametrize(
    ("url", "found"),
    [
        ("udp:0.0.0.0:14550", ("udpin", "0.0.0.0", 14550)),
        ("udp://:14540", ("udpin", "127.0.0.1", 14540)),
        ("udpout:14540", ("udpout", "127.0.0.1", 14540)),
        ("tcpin:127.0.0.1:5760", ("tcp", "127.0.0.1", 5760)),
    ],
)
def test_the_spellings_of_other_programs_are_read_and_no_host_is_loopback(url, found):
    assert parse_url(url) == found


@pytest.mark.parametrize("url", ["udpin:127.0.0.1:14540", "udpout:[::1]:14540", "tcp:127.0.0.1:5760"])
def test_the_other_end_of_the_other_end_is_the_link_itself(url):
    assert other_end(other_end(url)) == url


@pytest.mark.parametrize(
    "url", ["", "upd:127.0.0.1:1", "udpin:127.0.0.1", "udpin:127.0.0.1:0", "tcp:h:70000", "udpin:::1", "udpout:h:1x"]
)
def test_anything_else_is_no_link(url):
    with pytest.raises(LinkUrlError, match="expected udpin:HOST:PORT"):
        parse_url(url)


@pytest.mark.parametrize("host", ["no-such-host.invalid", "two..dots", "x" * 64 + ".invalid"])
def test_a_host_that_nobody_knows_is_named(host):
    with pytest.raises(LinkUrlError, match=re.escape(host)):
        open_link(f"udpout:{host}:14540")


@pytest.mark.parametrize(("scheme", "kind"), [("udpin", socket.SOCK_DGRAM), ("tcp", socket.SOCK_STREAM)])
def test_a_port_in_use_is_an_error_of_the_input(scheme, kind):
    with socket.socket(socket.AF_INET, kind) as holder:
        holder.bind(("127.0.0.1", 0))
        if kind == socket.SOCK_STREAM:
            holder.listen()
        with pytest.raises(LinkBusyError, match=str(holder.getsockname()[1])) as error:
            open_link(f"{scheme}:127.0.0.1:{holder.getsockname()[1]}")
    assert error.value.exit_code == 2


def test_udpout_talks_first_and_udpin_answers():
    port = free_port()
    inside, outside = open_link(f"udpin:127.0.0.1:{port}"), open_link(f"udpout:127.0.0.1:{port}")
    inside.send(b"nobody there yet")
    outside.send(b"hello")
    assert receive(inside) == b"hello"
    inside.send(b"welcome")
    assert receive(outside) == b"welcome"
    inside.close()
    outside.close()


def test_udpout_hears_nobody_but_its_peer():
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other,
    ):
        peer.bind(("127.0.0.1", 0))
        link = open_link(f"udpout:127.0.0.1:{peer.getsockname()[1]}")
        link.send(b"here")
        _, address = peer.recvfrom(100)
        other.sendto(b"intruder", address)
        peer.sendto(b"friend", address)
        assert receive(link) == b"friend"
        link.close()


def test_udpout_to_a_closed_port_loses_its_datagrams_in_silence():
    link = open_link(f"udpout:127.0.0.1:{free_port()}")
    for _ in range(5):
        link.send(b"lost")
        assert link.receive() == []
    link.close()


def test_tcp_serves_one_client_after_another():
    port = free_port(socket.SOCK_STREAM)
    link = open_link(f"tcp:127.0.0.1:{port}")
    link.send(b"nobody there yet")
    for word in (b"first", b"second"):
        with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S) as client:
            client.sendall(word)
            assert receive(link) == word
            link.send(b"back")
            assert client.recv(100) == b"back"
        assert wait({"it": link}, 5.0) == []  # the end of the stream
    link.close()


def test_a_tcp_client_that_does_not_keep_up_misses_whole_datagrams_and_keeps_its_connection():
    port = free_port(socket.SOCK_STREAM)
    link = open_link(f"tcp:127.0.0.1:{port}")
    with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S) as client:
        client.sendall(b"here")
        assert receive(link) == b"here"
        for k in range(MANY):
            link.send(f"{k:999}\n".encode())
        text = b""
        while not text.endswith(f"{MANY - 1:999}\n".encode()):
            text += client.recv(1 << 16)
            link.receive()
    numbers = [int(row) for row in text.decode().splitlines()]
    assert all(len(row) == 999 for row in text.decode().splitlines())
    assert numbers == sorted(set(numbers))
    assert len(numbers) < MANY
    link.close()


def test_a_new_tcp_client_replaces_the_old():
    port = free_port(socket.SOCK_STREAM)
    link = open_link(f"tcp:127.0.0.1:{port}")
    with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S) as old:
        old.sendall(b"old")
        assert receive(link) == b"old"
        with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S) as new:
            new.sendall(b"new")
            assert receive(link) == b"new"
            assert old.recv(100) == b""
    link.close()


def test_on_time_samples_keep_an_absolute_schedule():
    pace = Pace(DT, 100.0)
    for k in range(1, 1001):
        pace.flown(pace.due + 0.0005)
        assert pace.due == pytest.approx(100.0 + k * DT)
    assert pace.overruns == 0


def test_after_a_stall_samples_catch_up_at_no_more_than_the_rate_allowed():
    pace = Pace(DT, 0.0)
    now, flown = 0.4, 0  # a hundred samples behind
    times = []
    while pace.due < now or flown < 100:
        now = max(now, pace.due)
        pace.flown(now)
        times.append(now)
        flown += 1
    gaps = [b - a for a, b in itertools.pairwise(times)]
    assert min(gaps) == pytest.approx(DT / CATCH_UP)
    assert pace.overruns > 90
    behind = 0.4 / (1 - 1 / CATCH_UP)
    assert times[-1] < behind + 0.1
    for _ in range(50):  # and is back on the schedule
        pace.flown(pace.due)
    assert pace.due / DT == pytest.approx(round(pace.due / DT))
