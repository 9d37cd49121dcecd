"""One conformance class over every kind of link."""

import contextlib
import os
import select
import socket
import termios
import threading
import time

import pytest

from dob_companion.errors import LinkBusyError
from dob_companion.runtime import LinkUrl, open_link, serial_line
from dob_companion.runtime.links import MOST_REFUSED
from dob_companion.runtime.serial_line import AHEAD_S, Clocked
from dob_companion.runtime.tcp import connections
from tests.recorder.flights import wait_until as until
from tests.runtime.messages import Ear, Talk

PATIENCE_S = 5.0
MANY = 5_000
"""Corrections of 40 bytes: more than any kernel keeps for a reader that does not read."""


def udp_socket():
    end = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    end.bind(("127.0.0.1", 0))
    end.settimeout(PATIENCE_S)
    return end


@contextlib.contextmanager
def udpin():
    with udp_socket() as probe:
        port = probe.getsockname()[1]
    link = open_link(LinkUrl("udpin", "127.0.0.1", port))
    with udp_socket() as peer:
        yield link, lambda data: peer.sendto(data, ("127.0.0.1", port)), lambda: peer.recv(4096)
    link.close()


@contextlib.contextmanager
def udpout():
    with udp_socket() as peer:
        link = open_link(LinkUrl("udpout", "127.0.0.1", peer.getsockname()[1]))
        link.write(b"hello")
        _, address = peer.recvfrom(4096)
        yield link, lambda data: peer.sendto(data, address), lambda: peer.recv(4096)
        link.close()


@contextlib.contextmanager
def tcp():
    with socket.create_server(("127.0.0.1", 0)) as server:
        link = open_link(LinkUrl("tcp", "127.0.0.1", server.getsockname()[1]))
        peer, _ = server.accept()
        peer.settimeout(PATIENCE_S)
        with peer:
            yield link, peer.sendall, lambda: peer.recv(4096)
        link.close()


@contextlib.contextmanager
def serial():
    master, slave = os.openpty()
    link = open_link(LinkUrl("serial", os.ttyname(slave), 921600))
    yield link, lambda data: os.write(master, data), lambda: os.read(master, 4096)
    link.close()
    os.close(master)
    os.close(slave)


def wait(link):
    assert select.select([link], [], [], PATIENCE_S)[0], "nothing came in"


@pytest.mark.parametrize("kind", [udpin, udpout, tcp, serial])
class TestEveryLink:
    def test_carries_bytes_both_ways(self, kind):
        with kind() as (link, send, receive):
            send(b"down")
            wait(link)
            assert link.read() == b"down"
            link.write(b"up")
            assert receive() == b"up"

    def test_reads_nothing_when_nothing_came(self, kind):
        with kind() as (link, _, _):
            assert link.read() is None


class FarEnd:
    """Reads what a link has to say, and lets it say more, until nothing comes any more."""

    def __init__(self, link, peer):
        self.link, self.peer, self.ear = link, peer, Ear()

    def read_to_the_end(self):
        while self.link.flush() or select.select([self.peer], [], [], 0.1)[0]:
            if select.select([self.peer], [], [], 0.0)[0]:
                self.ear.hear(os.read(self.peer, 4096))
        return self.ear


@contextlib.contextmanager
def pty_far_end(baud):
    master, slave = os.openpty()
    link = open_link(LinkUrl("serial", os.ttyname(slave), baud))
    yield FarEnd(link, master)
    link.close()
    os.close(master)
    os.close(slave)


@contextlib.contextmanager
def tcp_far_end():
    with socket.create_server(("127.0.0.1", 0)) as server:
        link = open_link(LinkUrl("tcp", "127.0.0.1", server.getsockname()[1]))
        peer, _ = server.accept()
        with peer:
            yield FarEnd(link, peer.fileno())
        link.close()


@pytest.mark.parametrize("far_end", [tcp_far_end, lambda: pty_far_end(921600), lambda: pty_far_end(57600)])
def test_a_far_end_that_does_not_read_holds_nothing_up_and_then_gets_whole_messages_and_the_newest(far_end):
    talk = Talk()
    with far_end() as end:
        for k in range(MANY):  # it returns: nothing here waits for the far end
            end.link.write(talk.correction(k), talk.text(k))
        ear = end.read_to_the_end()
        assert ear.stamps[-1] == MANY - 1
        assert ear.texts[-1] == MANY - 1
        assert len(ear.stamps) < MANY
        assert ear.stamps == sorted(ear.stamps)
        assert ear.texts == sorted(ear.texts)
        assert any("the line is full" in event.text for event in end.link.events())


@pytest.mark.parametrize("far_end", [tcp_far_end, lambda: pty_far_end(921600)])
def test_a_line_with_room_carries_every_correction_of_one_turn(far_end):
    talk = Talk()
    with far_end() as end:
        end.link.write(*(talk.correction(k) for k in range(5)), talk.text(5))
        ear = end.read_to_the_end()
        assert (ear.stamps, ear.texts) == ([0, 1, 2, 3, 4], [5])
        assert not any("full" in event.text for event in end.link.events())


def test_a_line_is_given_no_more_than_its_baud_rate_carries():
    talk, baud = Talk(), 57600
    with pty_far_end(baud) as end:
        begun, given = time.monotonic(), 0
        for k in range(2000):
            message = talk.correction(k)
            end.link.write(message)
            while select.select([end.peer], [], [], 0.0)[0]:
                given += len(os.read(end.peer, 4096))
        assert given <= baud / 10 * (time.monotonic() - begun + AHEAD_S) + 2 * len(message)
        assert given > 0


def test_a_line_clocked_by_its_rate_empties_by_its_rate():
    line = Clocked(5760.0)
    line.given(576, now=10.0)
    assert line.held(10.0) == 576
    assert line.held(10.05) == pytest.approx(288, abs=1)
    assert line.held(11.0) == 0
    line.given(576, now=20.0)
    assert line.held(20.0) == 576


def test_a_device_that_cannot_be_configured_when_it_comes_back_is_tried_again(monkeypatch):
    master, slave = os.openpty()
    link = open_link(LinkUrl("serial", os.ttyname(slave), 57600))
    with monkeypatch.context() as broken:
        broken.setattr(termios, "tcsetattr", _input_output_error)
        link._lose("for the test")
        until(lambda: link.fileno() == -1 and link._opening is None)
        link.write(b"nobody there")
        assert link.read() is None
    link._retry_at = 0.0
    until(lambda: link.fileno() >= 0)
    assert [event.text.partition(": ")[2].partition(":")[0] for event in link.events()] == [
        "the device is gone",
        "the device is back",
    ]
    link.close()
    os.close(master)
    os.close(slave)


def test_a_device_that_takes_its_time_to_open_holds_nobody_up(monkeypatch):
    master, slave = os.openpty()
    link = open_link(LinkUrl("serial", os.ttyname(slave), 57600))
    ready, opened = threading.Event(), serial_line._opened
    monkeypatch.setattr(serial_line, "_opened", lambda url: ready.wait() and opened(url))
    link._lose("for the test")
    assert [link.fileno() for _ in range(1000)] == [-1] * 1000
    assert link.read() is None
    ready.set()
    until(lambda: link.fileno() >= 0)
    link.write(b"again")
    assert os.read(master, 5) == b"again"
    link.close()
    os.close(master)
    os.close(slave)


def test_a_device_that_opens_when_the_link_has_been_left_is_given_back(monkeypatch):
    master, slave = os.openpty()
    link = open_link(LinkUrl("serial", os.ttyname(slave), 57600))
    ready, opened = threading.Event(), serial_line._opened
    monkeypatch.setattr(serial_line, "_opened", lambda url: ready.wait() and opened(url))
    link._lose("for the test")
    link.fileno()
    late = link._opening
    link.close()
    ready.set()
    late.join()
    assert not late.port.is_open
    os.close(master)
    os.close(slave)


def _input_output_error(*_):
    raise termios.error(5, "Input/output error")


def test_an_address_that_does_not_answer_is_waited_for_by_nobody():
    with socket.socket() as server, contextlib.ExitStack() as full:
        server.bind(("127.0.0.1", 0))
        server.listen(0)
        for _ in range(3):  # more than its queue holds: the kernel drops further requests
            client = full.enter_context(socket.socket())
            client.setblocking(False)
            client.connect_ex(server.getsockname())
        link = open_link(LinkUrl("tcp", "127.0.0.1", server.getsockname()[1]))
        assert [link.fileno() for _ in range(1000)] == [-1] * 1000
        link.write(b"nobody there")
        assert link.read() is None
        link.close()


def test_every_address_of_a_host_is_tried():
    complaints = []
    with socket.create_server(("127.0.0.1", 0)) as server, socket.socket() as closed:
        closed.bind(("127.0.0.1", 0))
        hosts = [(socket.AF_INET, end.getsockname()) for end in (closed, server)]
        found = None
        for _ in range(MANY):
            found = found or next(connections(hosts, complaints.append, 0.0))
        assert found.getpeername() == server.getsockname()
        found.close()
        assert next(connections(hosts[:1], complaints.append, 0.0)) is None
    assert complaints == ["Connection refused"]


def test_a_server_that_is_not_there_is_said_once():
    with socket.socket() as closed:
        closed.bind(("127.0.0.1", 0))
        link = open_link(LinkUrl("tcp", "127.0.0.1", closed.getsockname()[1]))
        for _ in range(100):
            assert link.fileno() == -1
        (event,) = link.events()
    assert "Connection refused" in event.text
    link.close()


def test_a_server_that_hangs_up_at_once_is_not_called_again_at_once():
    with socket.create_server(("127.0.0.1", 0)) as server:
        link = open_link(LinkUrl("tcp", "127.0.0.1", server.getsockname()[1]))
        server.accept()[0].close()
        wait(link)
        assert link.read() is None
        assert link.fileno() == -1
        assert [event.text.rpartition(": ")[2] for event in link.events()] == [
            "connected",
            "the other end has closed the connection",
        ]
        link.close()


@pytest.mark.parametrize("scheme", ["tcp", "udpin", "udpout"])
@pytest.mark.parametrize("host", ["no-such-host.invalid", "two..dots", "x" * 64 + ".example"])
def test_a_host_that_cannot_be_resolved_is_one_line(scheme, host):
    with pytest.raises(LinkBusyError, match=r"cannot be resolved") as caught:
        open_link(LinkUrl(scheme, host, 14540))
    assert host in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_flood_of_strangers_lets_the_loop_have_its_turn():
    with udpin() as (link, send, _):
        send(b"peer")
        wait(link)
        assert link.read() == b"peer"
        with udp_socket() as stranger:
            for _ in range(2 * MOST_REFUSED):
                stranger.sendto(b"x", link._socket.getsockname())
            assert link.read() is None
            send(b"peer again")
            assert b"peer again" in [link.read() for _ in range(3)]


def test_a_listener_follows_a_new_peer_only_when_the_old_one_is_silent():
    with udpin() as (link, send, receive):
        send(b"first")
        wait(link)
        link.read()
        with udp_socket() as stranger:
            stranger.sendto(b"me", link._socket.getsockname())
            wait(link)
            assert link.read() is None
        link.write(b"answer")
        assert receive() == b"answer"


def test_a_lost_tcp_connection_is_opened_again():
    with socket.create_server(("127.0.0.1", 0)) as server:
        link = open_link(LinkUrl("tcp", "127.0.0.1", server.getsockname()[1]))
        first, _ = server.accept()
        first.close()
        wait(link)
        assert link.read() is None
        accepted = []
        waiter = threading.Thread(target=lambda: accepted.append(server.accept()[0]))
        waiter.start()
        while waiter.is_alive():
            link.fileno()
            waiter.join(0.01)
        accepted[0].sendall(b"again")
        wait(link)
        assert link.read() == b"again"
        accepted[0].close()
        link.close()


def test_a_port_in_use_is_one_clear_error():
    with udp_socket() as taken:
        port = taken.getsockname()[1]
        with pytest.raises(LinkBusyError, match=rf"udpin:127.0.0.1:{port}.*in use"):
            open_link(LinkUrl("udpin", "127.0.0.1", port))


def test_a_device_that_is_not_there_is_one_clear_error(tmp_path):
    with pytest.raises(LinkBusyError, match=r"serial:.*cannot be opened"):
        open_link(LinkUrl("serial", str(tmp_path / "ttyNONE"), 57600))
