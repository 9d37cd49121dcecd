"""The status page in a real browser, beside the real daemon."""

import re

import pytest

from tests.cli.processes import UdpVehicle, daemon
from tests.ports import free_port
from tests.view.test_page import free_tcp_port
from tests.view.watching import CHROMIUM, Browser

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no browser found: install the package chromium")

_POINTS = '[...document.querySelectorAll("#{0} polyline")].map(l => l.getAttribute("points").split(" ").length)'


def test_the_page_follows_a_flight_and_says_when_the_daemon_has_gone(design, tmp_path):
    port, page = free_port(), free_tcp_port()
    url = f"http://127.0.0.1:{page}/"
    with Browser(tmp_path / "profile") as browser:
        with daemon(design, port, "--status-page", str(page)) as process, UdpVehicle(port) as vehicle:
            browser.open(url)
            browser.wait_for('document.getElementById("state").textContent === "DISABLED"')
            vehicle.activate()
            vehicle.fly(10)
            browser.wait_for('document.getElementById("state").textContent === "ACTIVE"')
            assert "design" in browser.wait_for('document.getElementById("who").textContent')
            captions = browser.wait_for('[...document.querySelectorAll("figcaption")].map(c => c.textContent)')
            assert captions[0] == "rolld_hat +0.2000correction −0.2000"
            assert captions[1] == "pitchd_hat +0.0000correction +0.0000"
            assert [re.match("gyro rate|delay|longest turn", caption) is not None for caption in captions[3:]] == 3 * [
                True
            ]
            before = browser.wait_for(_POINTS.format("axes"))
            assert len(before) == 6
            browser.wait_for(f"{_POINTS.format('axes')}[0] > {before[0]}")
            assert "DOB ACTIVE: faded in" in browser.wait_for('document.getElementById("events").textContent')
            assert browser.complaints == []
            process.terminate()
            vehicle.last_correction(process)
        browser.wait_for('document.getElementById("state").textContent === "GONE"')
        with daemon(design, port, "--status-page", str(page)):
            browser.wait_for('document.getElementById("state").textContent === "DISABLED"')
            assert "DOB ACTIVE" not in browser.wait_for('document.getElementById("events").textContent')
        assert {asked for asked in browser.requests if not asked.startswith("data:")} == {url, f"{url}feed"}


def test_the_page_shows_a_vehicle_that_has_gone_as_gone_and_draws_no_line_across_a_hole(design, tmp_path):
    port, page = free_port(), free_tcp_port()
    delay = '[...document.querySelectorAll("#health figure:nth-child(2) polyline")].length'
    with Browser(tmp_path / "profile") as browser, daemon(design, port, "--status-page", str(page)) as process:
        with UdpVehicle(port) as vehicle:
            browser.open(f"http://127.0.0.1:{page}/")
            vehicle.activate()
            browser.wait_for('document.getElementById("state").textContent === "ACTIVE"')
            browser.wait_for('/^vehicle last heard \\d+ s ago$/.test(document.getElementById("why").textContent)')
            captions = browser.wait_for('[...document.querySelectorAll("figcaption")].map(c => c.textContent)')
            assert captions[0] == "rolld_hat +0.0000correction +0.0000"
            assert captions[3:5] == ["gyro rate 0.0 of 250 Hz", "delay, samples –"]
            assert browser.wait_for(delay) == 1
            vehicle.sample += 1000
            vehicle.fly(100)
            browser.wait_for(f"{delay} === 2")
        process.terminate()


def test_the_browser_refuses_whatever_the_page_does_not_bring_along(design, tmp_path):
    page = free_tcp_port()
    with Browser(tmp_path / "profile") as browser, daemon(design, free_port(), "--status-page", str(page)):
        browser.open(f"http://127.0.0.1:{page}/")
        browser.wait_for('document.getElementById("state").textContent === "DISABLED"')
        browser.wait_for(
            'document.body.append(Object.assign(new Image(), { src: "https://example.invalid/x.png" })) ?? true'
        )
        browser.wait_for("true")
        assert any("Content Security Policy" in complaint for complaint in browser.complaints)
