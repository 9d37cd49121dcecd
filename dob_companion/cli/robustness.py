"""The findings of a certificate over an uncertain plant, as lines of text."""

from dob_companion.artifact import DobBlock


def robustness_words(block: DobBlock) -> str:
    """What is proved over the block's uncertainty; empty when none was stated."""
    extra = block.certificate.extra
    if "robust_safe_factor" not in extra:
        return ""
    stable = "proved" if extra["robust_stable"] else "NOT proved"
    rows = [
        ("robust stability", f"{stable} (mu at most {_number(extra['robust_mu_bound'])})"),
        ("safe up to", f"{_number(extra['robust_safe_factor'])} times the stated uncertainty"),
    ]
    if "robust_unsafe_factor" in extra:
        rows.append(("unstable plant found at", f"{_number(extra['robust_unsafe_factor'])} times"))
    else:
        rows.append(("unstable plant", f"none found up to {_number(extra['robust_farthest_factor'])} times"))
    rows.append(("gamma of the model", _number(extra["robust_gamma_nominal"])))
    if "robust_gamma_bound" in extra:
        worst = f"{_number(extra['robust_gamma_sampled'])} sampled, at most {_number(extra['robust_gamma_bound'])}"
        rows.append(("gamma of the worst plant", worst))
    rows.append(("noise weight solved for", f"{_number(extra['robust_noise_scale'])} times the spec's"))
    return "\n".join([f"{block.name}, over its uncertainty", *(f"  {name.ljust(24)} {text}" for name, text in rows)])


def _number(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, int | float) else str(value)
