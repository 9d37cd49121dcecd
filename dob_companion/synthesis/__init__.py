"""Design of certified H-infinity disturbance observers; python-control's StateSpace in and out.

    import control as ct
    from dob_companion.synthesis import synthesize

    result = synthesize(G, C, W_d, W_n, delay_samples=1, axes=("pitch",))
    print(result)            # what was measured, not claimed: result.certificate
    result.observer          # D(z): [y_n; u_e] -> d_hat
    design_json(result)      # the text of a design.json that flies

One room per question, each on those before it: `spec` (what is asked), `plant` (posed, and can it be), `norms` (how
large, by proof), `solve` (twice), `certify` (measured), `robust` (for a family of plants), `tune` (with weights of its
own). `design` walks through them, `verify` walks again from the file.
"""

from dob_companion.synthesis.certify.responses import Responses, block_responses, default_frequencies, standard_form
from dob_companion.synthesis.design import (
    Synthesis,
    design,
    design_block,
    design_from_toml,
    design_json,
    synthesize,
)
from dob_companion.synthesis.plant.models import polynomial, zpk
from dob_companion.synthesis.plant.problem import Problem
from dob_companion.synthesis.spec.parse import Spec, parse_spec
from dob_companion.synthesis.verify import Finding, verify

__all__ = [
    "Finding",
    "Problem",
    "Responses",
    "Spec",
    "Synthesis",
    "block_responses",
    "default_frequencies",
    "design",
    "design_block",
    "design_from_toml",
    "design_json",
    "parse_spec",
    "polynomial",
    "standard_form",
    "synthesize",
    "verify",
    "zpk",
]
