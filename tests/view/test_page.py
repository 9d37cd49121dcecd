"""The status page's server against clients that are many, slow, curious or hostile."""

import contextlib
import re
import socket
import threading
from pathlib import Path

import pytest

from dob_companion.view.page import EVENTS, MOMENTS, MOST_CONNECTIONS, MOST_STREAMS, PAGE, Board, StatusServer
from tests.cli.processes import PATIENCE_S, daemon, one_line, run_cli
from tests.ports import free_port
from tests.report.html import Page
from tests.view.watching import get, stream


@pytest.fixture
def page():
    """A server in this process; yields its board and port."""
    board = Board()
    server = StatusServer(socket.create_server(("127.0.0.1", 0)), board)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    yield board, server.socket.getsockname()[1]
    board.close()
    server.shutdown()
    server.server_close()
    thread.join()


@pytest.mark.parametrize(
    "path",
    [
        "/x",
        "//etc/passwd",
        "/../../etc/passwd",
        "/%2e%2e/page.py",
        "/status.html",
        "/feed/",
        "/feed?x",
        "/?",
        "/" + 9000 * "a",
    ],
)
def test_any_other_path_is_not_there(page, path):
    _, port = page
    status, _, body = get(port, path)
    assert status == 404
    assert b"root:" not in body


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS", "TRACE", "X"])
def test_nothing_can_be_written(page, method):
    assert get(page[1], "/", method)[0] == 501


@pytest.mark.parametrize(
    "host", ["evil.example", "127.0.0.1.evil.example", "localhost.evil.example:80", "", "localhost:80:80"]
)
def test_a_foreign_name_for_this_server_is_refused(page, host):
    assert get(page[1], "/feed", host=host)[0] == 403


@pytest.mark.parametrize("host", ["localhost", "127.0.0.1", "localhost:9999"])
def test_the_names_of_loopback_are_taken_with_any_port_as_of_a_tunnel(page, host):
    assert get(page[1], "/", host=host)[0] == 200


@pytest.mark.parametrize("garbage", [b"\0" * 4096, b"GET\r\n\r\n", b"\xff\xfe /\r\n\r\n", b"GET / HTTP/9.9\r\n\r\n"])
def test_garbage_in_place_of_a_request_harms_nobody(page, garbage):
    with socket.create_connection(("127.0.0.1", page[1]), 10) as connection:
        connection.sendall(garbage + b"\r\n")
        connection.shutdown(socket.SHUT_WR)
        with contextlib.suppress(ConnectionResetError):
            while connection.recv(65536):
                pass
    assert get(page[1])[0] == 200


def test_more_streams_than_allowed_are_turned_away_until_one_leaves(page):
    board, port = page
    board.post(b'{"daemon":{}}')
    with contextlib.ExitStack() as readers:
        for _ in range(MOST_STREAMS):
            head, said = readers.enter_context(stream(port))
            assert b"200" in head
            next(said)
        with stream(port) as (head, _):
            assert b"503" in head
        assert get(port)[0] == 200
    for k in range(10_000):  # readers that have left are noticed at the next line
        board.post(b'{"moment":%d}' % k)
        with stream(port) as (head, _):
            if b"200" in head:
                break
    else:
        raise AssertionError("no room was made")


def test_connections_beyond_the_limit_are_shut_at_once_and_the_page_comes_back(page):
    _, port = page
    idle = [socket.create_connection(("127.0.0.1", port), 10) for _ in range(MOST_CONNECTIONS)]
    with socket.create_connection(("127.0.0.1", port), 10) as one_more, contextlib.suppress(ConnectionResetError):
        assert one_more.recv(10) == b""
    for connection in idle:
        connection.close()
    while True:
        with contextlib.suppress(ConnectionError):
            assert get(port)[0] == 200
            break


def test_a_reader_that_takes_nothing_keeps_nobody_from_reading(page):
    board, port = page
    board.post(b'{"daemon":{}}')
    with stream(port) as (slow, _), stream(port) as (quick, said):
        assert b"200" in slow
        assert b"200" in quick
        next(said)
        for k in range(3000):  # three megabytes, more than the sockets between hold
            board.post(b'{"moment":{"k":%d,"pad":"%s"}}' % (k, 1000 * b"x"))
            if k % 100 == 0:
                while "moment" not in (seen := next(said)) or seen["moment"]["k"] < k:
                    pass


def test_who_comes_late_gets_the_last_minute_and_the_last_events(page):
    board, port = page
    board.post(b'{"daemon":{"version":"1"}}')
    for k in range(2 * MOMENTS):
        board.post(b'{"moment":%d}' % k)
        board.post(b'{"event":"%d"}' % k)
    with stream(port) as (_, said):
        seen = [next(said) for _ in range(1 + MOMENTS + EVENTS)]
    assert "daemon" in seen[0]
    assert [each["moment"] for each in seen if "moment" in each] == [*range(MOMENTS, 2 * MOMENTS)]
    assert [int(each["event"]) for each in seen if "event" in each] == [*range(2 * MOMENTS - EVENTS, 2 * MOMENTS)]


def test_the_page_is_whole_asks_nobody_else_and_runs_only_its_own_script(page):
    _, headers, body = get(page[1])
    assert body == PAGE.read_bytes()
    read = Page(body.decode())
    assert read.addresses == ["data:,"]
    assert not re.search(r"https?://(?!www\.w3\.org/)", body.decode())
    assert "innerHTML" not in body.decode()
    policy = headers["Content-Security-Policy"]
    assert policy.startswith("default-src 'none'; script-src 'sha256-")
    assert "unsafe" not in policy
    assert headers["Cache-Control"] == "no-store"


def test_the_daemon_serves_it_on_loopback_only_and_not_unless_asked(design):
    page = free_tcp_port()
    with daemon(design, free_port(), "--status-page", str(page)) as process:
        assert get(page)[0] == 200
        assert listening_on(page) == {"0100007F"}  # 127.0.0.1
        process.terminate()
        assert process.wait(PATIENCE_S) == 0
    assert listening_on(page) == set()
    with daemon(design, free_port()) as process:
        assert not Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()


def free_tcp_port():
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return probe.getsockname()[1]


def listening_on(port):
    """Local addresses, in hexadecimal, of everything that listens on a TCP port (proc_net(5))."""
    rows = [line.split() for name in ("tcp", "tcp6") for line in Path(f"/proc/net/{name}").read_text().splitlines()[1:]]
    return {row[1].partition(":")[0] for row in rows if row[1].endswith(f":{port:04X}") and row[3] == "0A"}


def test_a_port_in_use_is_one_line_and_exit_2(design):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        finished = run_cli("run", "--design", design, "--link", f"udpin:127.0.0.1:{free_port()}", "--status-page", port)
    assert finished.returncode == 2
    assert f"--status-page {port}" in one_line(finished)
    assert "in use" in one_line(finished)


@pytest.mark.parametrize("port", ["65536", "-1", "x", "1.5"])
def test_a_port_that_is_none_is_exit_2(design, port):
    finished = run_cli("run", "--design", design, f"--status-page={port}")
    assert finished.returncode == 2
    assert "--status-page" in finished.stderr.splitlines()[-1]
