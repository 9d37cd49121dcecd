"""The pages in a real browser, opened from disk: no complaint on the console, and the figures answer."""

import json
import re
import subprocess
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from dob_companion.report import draw
from dob_companion.report.chart import Band, Chart, Curve, Panel, Scale
from tests.browser import CHROMIUM, FLAGS, NAMES
from tests.report.material import coupled_html, design_html, flight_html, hostile_html

_FLAGS = (
    *FLAGS,
    "--enable-logging=stderr",  # the console's lines, marked CONSOLE
    "--dump-dom",
)

# Works a figure as a hand with a mouse does and leaves what it saw in the page, where --dump-dom shows it.
_HAND = """<script>
const hand = (key) => {
  const figure = document.getElementById(key), svg = figure.querySelector("svg"), area = svg.getBoundingClientRect();
  svg.setPointerCapture = () => {};  // a made-up pointer cannot be captured
  const at = (name, x, y) => svg.dispatchEvent(new PointerEvent(name, {
    bubbles: true, pointerId: 1, pointerType: "mouse", button: 0,
    clientX: area.left + area.width * x, clientY: area.top + area.height * y,
  }));
  const readout = () => { const box = figure.querySelector(".readout"); return box.hidden ? "" : box.innerText; };
  const live = () => figure.querySelectorAll(".live polyline").length;
  const seen = { before: readout(), still: live() };
  at("pointermove", 0.3, 0.3); seen.hover = readout();
  at("pointerdown", 0.2, 0.3); at("pointermove", 0.3, 0.3); at("pointerup", 0.3, 0.3); seen.zoomed = live();
  const drawn = (name) => [...figure.querySelectorAll(".live " + name)];
  seen.lines = drawn("polyline").map((node) => node.getAttribute("points").split(" ").map(Number.parseFloat));
  seen.areas = drawn("polygon").length;
  svg.dispatchEvent(new MouseEvent("dblclick", { bubbles: true })); seen.reset = live();
  at("pointerleave", 0.3, 0.3); seen.after = readout();
  return seen;
};
const report = document.body.appendChild(document.createElement("pre"));
report.id = "hand";
report.textContent = JSON.stringify(Object.fromEntries(KEYS.map((key) => [key, hand(key)])));
</script>"""


@pytest.fixture(scope="module")
def chromium() -> str:
    if CHROMIUM is None:
        pytest.skip(f"no browser found, looked for {', '.join(NAMES)}: install the package chromium")
    return CHROMIUM


def _open(chromium: str, folder: Path, html: str) -> tuple[str, list[str]]:
    """The page's DOM after its scripts ran, and what the browser wrote on the console."""
    page = folder / "page.html"
    page.write_text(html, encoding="utf-8")
    command = [chromium, *_FLAGS, f"--user-data-dir={folder / 'profile'}", page.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    return done.stdout, [line for line in done.stderr.splitlines() if "CONSOLE" in line]


def _worked(chromium: str, folder: Path, html: str, keys: list[str]) -> tuple[dict, list[str]]:
    dom, console = _open(chromium, folder, html + _HAND.replace("KEYS", json.dumps(keys)))
    found = re.search(r'<pre id="hand">(.*?)</pre>', dom, flags=re.S)
    assert found, f"the figures did not answer; console: {console}"
    return json.loads(found[1].replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&")), console


def test_the_flight_page_answers_to_pointing_and_zooming(chromium, tmp_path):
    seen, console = _worked(chromium, tmp_path, flight_html(), ["fig8", "fig13"])
    assert console == []
    for one in seen.values():
        assert (one["before"], one["after"], one["still"], one["reset"]) == ("", "", 0, 0)
        assert one["zoomed"] > 0
    assert re.search(r"frequency\s*[\d.]+ Hz", seen["fig8"]["hover"])
    assert re.search(r"roll d → d̂\s*−?[\d.]+ dB", seen["fig8"]["hover"])
    assert re.search(r"pitch disturbance d\s*−?[\d.]+ normalized", seen["fig13"]["hover"])


def test_the_design_page_answers_to_pointing_and_zooming(chromium, tmp_path):
    seen, console = _worked(chromium, tmp_path, design_html(), ["b0-fig9", "b2-gust0"])
    assert console == []
    assert re.search(r"observer off\s*−?[\d.]+ dB\s*observer on\s*−?[\d.]+ dB", seen["b0-fig9"]["hover"])
    assert seen["b0-fig9"]["zoomed"] == 2
    assert "rad/s" in seen["b2-gust0"]["hover"]


def test_a_zoomed_curve_keeps_its_gaps(chromium, tmp_path):
    t = np.linspace(0.0, 10.0, 101)
    y = np.where((t > 1.35) & (t < 1.65), np.nan, np.sin(t))
    band = Band("", t, y - 0.1, np.where((t > 1.85) & (t < 1.95), np.nan, y + 0.1), "on")
    panel = Panel(0, 0, Scale("time", "s", 0.0, 10.0), Scale("y", "", -1.2, 1.2), (Curve("y", t, y, "on"),), (band,))
    chart = Chart("gaps", "a curve with a gap", (panel,))
    seen, console = _worked(chromium, tmp_path, _one_figure(chart), ["gaps"])
    assert console == []
    before, after = seen["gaps"]["lines"]
    step = before[1] - before[0]
    assert after[0] - before[-1] == pytest.approx(4.0 * step, rel=0.05)  # three samples are missing
    assert max(np.diff(before + after)) == pytest.approx(4.0 * step, rel=0.05)
    assert seen["gaps"]["areas"] == 3


def test_the_readout_says_nothing_of_a_curve_where_it_is_not(chromium, tmp_path):
    """The hand points at 30 % of the width: within the line's one long piece, before, after and in a gap of others."""
    t = np.linspace(0.0, 10.0, 1001)
    curves = (
        Curve("all along", t, 0.5 + 0.0 * t, "on"),
        Curve("two points", np.array([0.0, 10.0]), np.array([-1.0, 1.0]), "bound"),
        Curve("before", t[:200], 0.1 + 0.0 * t[:200], "off"),
        Curve("after", t[500:], 0.2 + 0.0 * t[500:], "off"),
        Curve("gap", t, np.where((t > 2.0) & (t < 4.0), np.nan, 0.3), "off"),
    )
    panel = Panel(0, 0, Scale("time", "s", 0.0, 10.0), Scale("y", "", -1.2, 1.2), curves)
    chart = Chart("ends", "curves that end", (panel,))
    seen, console = _worked(chromium, tmp_path, _one_figure(chart), ["ends"])
    assert console == []
    shown = dict(re.findall(r"^(.+?)\s*(−?[\d.]+)(?: \w+)?\s*$", seen["ends"]["hover"], flags=re.MULTILINE))
    assert set(shown) == {"time", "all along", "two points"}
    at = float(shown["time"])
    assert 2.0 < at < 4.0
    assert float(shown["two points"].replace("−", "-")) == pytest.approx(-1.0 + at / 5.0, abs=2e-3)


def _one_figure(chart):
    script = (files("dob_companion.report") / "static" / "page.js").read_text(encoding="utf-8")
    return (
        f'<!doctype html><figure class="chart" id="{chart.key}" data-key="{chart.key}">{draw.svg(chart)}'
        f'<script type="application/json">{draw.data(chart)}</script></figure><script>{script}</script>'
    )


def test_a_hostile_design_runs_no_script_of_its_own(chromium, tmp_path):
    seen, console = _worked(chromium, tmp_path, hostile_html(), ["b0-fig7"])
    assert console == []
    assert "Q" in seen["b0-fig7"]["hover"]


def test_a_fault_on_the_page_would_be_noticed(chromium, tmp_path):
    _, console = _open(chromium, tmp_path, hostile_html() + '<img src="https://example.invalid/x.png">')
    assert any("Content Security Policy" in line for line in console)


_WIDTH = """<script>
const over = [...document.querySelectorAll("main *")].filter((node) =>
  node.getBoundingClientRect().right > innerWidth + 1 && !node.closest(".scroll, .table, svg"));
const seen = [innerWidth, document.documentElement.scrollWidth, ...over.map((node) => node.outerHTML.slice(0, 60))];
parent.postMessage(seen, "*");
</script>"""


@pytest.mark.parametrize("html", [design_html, flight_html, coupled_html], ids=["design", "flight", "coupled"])
def test_a_page_does_not_scroll_sideways_on_a_telephone(chromium, tmp_path, html):
    """In a frame, since no window of the browser is that narrow. Figures and tables scroll within themselves."""
    (tmp_path / "narrow.html").write_text(html() + _WIDTH, encoding="utf-8")
    frame = (
        '<!doctype html><pre id="hand"></pre><script>onmessage = (event) => '
        '{ document.getElementById("hand").textContent = JSON.stringify(event.data); }</script>'
        '<iframe src="narrow.html" width="400" height="800"></iframe>'
    )
    dom, _ = _open(chromium, tmp_path, frame)
    inner, needed, *over = json.loads(re.search(r'<pre id="hand">(.*?)</pre>', dom, flags=re.S)[1])
    assert inner == 400
    assert needed <= inner, over
    assert over == []
