"""One conformance class over every kind of link."""

import contextlib
import os
import select
import socket
import threading

import pytest

from dob_companion.errors import LinkBusyError
from dob_companion.runtime import LinkUrl, open_link

PATIENCE_S = 5.0


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
