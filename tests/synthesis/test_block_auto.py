"""What [auto] asks of all blocks, and a block's own [block.auto] in its place."""

import pytest

from dob_companion.errors import SpecError
from dob_companion.synthesis import parse_spec
from dob_companion.synthesis.spec.spectrum import Band, LowPass, Measured
from tests.synthesis.test_tuning import EXAMPLE

OWN = "[block.auto]\ndisturbance_corner_hz = 2.0\nnoise_density = 1e-4\nleast_disk_margin = 0.5\n"
OWN += "disturbance_rms = 0.05\n"
COMMON = EXAMPLE[EXAMPLE.index("[auto]") : EXAMPLE.index("[[block]]")]


def with_own(own=OWN, text=EXAMPLE):
    return text.replace('axes = ["roll"]\n', f'axes = ["roll"]\n{own}', 1)


def blocks(text, read=None):
    spec = parse_spec(text, "auto.toml", read)
    return {block.name: block for block in spec.blocks}


def test_a_blocks_own_keys_hold_for_it_alone_and_take_the_place_of_those_that_say_the_same():
    found = blocks(with_own())
    roll, pitch = found["roll"].auto, found["pitch"].auto
    assert (roll.spectrum, pitch.spectrum) == (LowPass(2.0), Band(0.1, 3.0))
    assert roll.noise_rms == pytest.approx(1e-4 * 125.0**0.5)
    assert (roll.least_disk_margin, pitch.least_disk_margin) == (0.5, 0.3812)
    assert (roll.disturbance_rms, pitch.disturbance_rms) == (0.05, None)
    assert roll.largest_noise == pitch.largest_noise == 1e-3
    assert found["yaw"].auto == pitch


def test_a_block_may_state_all_of_it_and_then_needs_no_weights():
    text = with_own(OWN.replace("[block.auto]", "[block.auto]\nlargest_noise_in_correction = 1e-3"))
    head, _, rest = text.replace(COMMON, "").partition('[[block]]\nname = "roll"')
    found = blocks(head + '[[block]]\nname = "roll"' + rest[: rest.index("[[block]]")])
    assert found["roll"].disturbance is None
    assert found["roll"].auto.least_disk_margin == 0.5
    assert found["pitch"].auto is None


def test_a_block_without_any_auto_must_have_weights():
    text = with_own().replace(COMMON, "")
    with pytest.raises(SpecError, match="block 'yaw': key 'weights' is missing"):
        parse_spec(text, "auto.toml")


@pytest.mark.parametrize(
    ("own", "said"),
    [
        ("[block.auto]\nleast_disk_margin = 2.5\n", "block 'roll': auto: least_disk_margin: expected a number between"),
        (
            "[block.auto]\nleast_disc_margin = 0.5\n",
            "block 'roll': auto: unknown key 'least_disc_margin'; did you",
        ),
        ("auto = 3\n", "block 'roll': auto: expected a table"),
        ('[block.auto]\ndisturbance_spectrum = "w.csv"\n', "block: auto: disturbance_spectrum: w.csv: a spec given as"),
    ],
)
def test_what_is_wrong_in_it_is_said_with_its_place(own, said):
    with pytest.raises(SpecError, match=said):
        parse_spec(with_own(own), "auto.toml")


def test_its_spectrum_may_be_in_a_file():
    own = '[block.auto]\ndisturbance_spectrum = "w.csv"\n'
    found = blocks(with_own(own), {"w.csv": b"0.2, 4.0\n2, 4e-1\n20, 1e-3\n"}.__getitem__)
    assert found["roll"].auto.spectrum == Measured((0.2, 2.0, 20.0), (4.0, 0.4, 0.001))
    assert found["pitch"].auto.spectrum == Band(0.1, 3.0)
