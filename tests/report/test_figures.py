"""`design` writes its page's figures as SVG files that stand alone."""

from xml.etree import ElementTree

from dob_companion.cli.main import main
from tests.synthesis.paper import SPEC

SVG = "{http://www.w3.org/2000/svg}"


def test_design_writes_every_figure_as_a_small_svg_of_its_own_size_and_ground(tmp_path):
    assert main(["design", str(SPEC), "-o", str(tmp_path), "--order", "3"]) == 0
    names = {path.name for path in (tmp_path / "figures").iterdir()}
    wanted = {"fig6", "fig7", "fig8", "fig9", "fig10", "nyquist0", "step0", "gust0", "roots"}
    assert names >= {f"{axis}-{figure}.svg" for axis in ("roll", "pitch", "yaw") for figure in wanted}
    for path in (tmp_path / "figures").iterdir():
        root = ElementTree.parse(path).getroot()
        _, _, width, height = root.get("viewBox").split()
        assert (root.get("width"), root.get("height")) == (width, height)
        assert root[0].tag == f"{SVG}rect"
        assert path.stat().st_size < 100_000
