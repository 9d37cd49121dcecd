"""The pages as text: whole, offline, deterministic, and true to their inputs."""

import json
import re
from functools import cache

import pytest

from dob_companion.report.design_page import design_page
from dob_companion.report.flight_page import flight_page
from dob_companion.report.hero import hero_png
from tests.report.html import Page
from tests.report.material import (
    HOSTILE,
    coupled_html,
    design_html,
    flight_html,
    hostile_design,
    hostile_html,
    one_block,
    paper_design,
    result,
    trace,
)

PAGES = {"design": design_html, "flight": flight_html, "coupled": coupled_html, "hostile": hostile_html}


@cache
def hero():
    return hero_png(trace(), result())


@pytest.fixture(params=list(PAGES))
def any_html(request) -> str:
    return PAGES[request.param]()


def test_every_element_is_closed_and_every_id_is_unique(any_html):
    page = Page(any_html)
    assert len(page.ids) == len(set(page.ids))
    assert page.tags["main"] == 1


def test_nothing_is_fetched_from_anywhere(any_html):
    without_namespaces = re.sub(r'xmlns(:xlink)?="http://www\.w3\.org/[^"]+"', "", any_html)
    # The script names the SVG namespace, which is an identifier and not an address that is opened.
    without_namespaces = without_namespaces.replace('const NS = "http://www.w3.org/2000/svg"', "")
    assert not re.search(r"https?://", without_namespaces)
    assert all(address.startswith(("#", "data:,")) for address in Page(any_html).addresses)


def test_the_page_forbids_the_browser_to_fetch_anything(any_html):
    assert "default-src 'none'" in any_html


def test_references_inside_figures_lead_to_ids_of_the_page(any_html):
    page = Page(any_html)
    wanted = set(re.findall(r"url\(#([^)]+)\)", re.sub(r"<script>.*?</script>", "", any_html, flags=re.S)))
    wanted |= {address[1:] for address in page.addresses if address.startswith("#")}
    assert wanted <= set(page.ids)


def test_a_flight_page_holds_the_overview_and_figures_7_to_13():
    text = flight_html()
    figures = re.findall(r'<figure [^>]*id="([^"]+)"', text)
    assert sorted(figures) == sorted(["overview", *(f"fig{n}" for n in range(7, 14))])
    assert [f"Fig. {n}." in text for n in range(7, 14)] == [True] * 7


def test_a_design_page_holds_figures_6_to_10_margins_and_responses_for_each_block():
    text = design_html()
    figures = set(re.findall(r'<figure [^>]*id="([^"]+)"', text))
    kinds = ("fig6", "fig7", "fig8", "fig9", "fig10", "nyquist0", "step0", "gust0", "roots")
    assert figures == {f"b{block}-{kind}" for block in range(3) for kind in kinds}
    assert text.count('class="diagram"') == 3


def test_a_coupled_block_shows_each_of_its_axes():
    text = coupled_html()
    assert "roll and pitch together" in text
    assert {"b0-nyquist0", "b0-nyquist1", "b0-gust1"} <= set(Page(text).ids)
    assert "roll · magnitude, dB" in text
    assert "pitch · magnitude, dB" in text


def test_the_same_inputs_give_the_same_bytes():
    assert design_page(hostile_design()) == hostile_html()
    assert flight_page(paper_design(), result(), trace()) == flight_html()
    assert hero_png(trace(), result()) == hero()


def test_the_table_holds_the_numbers_of_the_result():
    text = flight_html()
    rows = {row[0]: row[1:] for row in Page(text).rows if len(row) == 8}
    order = ("peak_off", "peak_on", "peak_ratio", "paper_ratio", "rms_off", "rms_on", "rms_ratio")
    for axis, numbers in result()["axes"].items():
        assert [float(cell) for cell in rows[axis]] == pytest.approx([numbers[name] for name in order], rel=5e-3)


def test_delay_rate_and_lost_samples_are_told_with_their_units():
    text = flight_html()
    assert "2 samples (8 ms)" in text
    assert "249.87\u00a0Hz" in text
    assert "3 of 15000" in text


def test_the_certificate_is_told_with_its_numbers():
    text = design_html()
    proof = paper_design().blocks[0].certificate
    assert f"γ = {proof.gamma:.5f}" in text
    assert f"γ* = {proof.gamma_star:.5f}" in text
    assert proof.gamma_star_method in text
    assert 'class="fails"' not in text
    assert "0.14131 (z + 1.716) / ((z − 1)(z − 0.9447))" in text


def test_a_failed_claim_is_shown_as_failed():
    text = design_page(one_block(disk_margin=0.05))
    assert text.count('class="fails"') == 1
    assert "Not fit to fly" in text


def test_text_from_a_file_is_escaped_everywhere():
    for text in (
        hostile_html(),
        flight_page(hostile_design(), result() | {"scenario": HOSTILE}, trace()),
    ):
        assert HOSTILE not in text
        assert "<script>alert" not in text
        assert "&lt;script&gt;alert" in text


def test_the_data_in_the_page_is_json_that_matches_the_figures():
    text = flight_html()
    blobs = re.findall(r'<script type="application/json">(.*?)</script>', text, flags=re.S)
    assert len(blobs) == 8
    for blob in blobs:
        panels = json.loads(blob)["panels"]
        assert panels
        assert all(panel["curves"] for panel in panels)


def test_pages_stay_small(any_html):
    assert len(any_html.encode()) < 3_000_000


def test_the_picture_is_a_small_png_of_1600_by_900():
    png = hero()
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    assert (int.from_bytes(png[16:20]), int.from_bytes(png[20:24])) == (1600, 900)
    assert len(png) < 250_000
