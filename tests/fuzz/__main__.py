"""`python -m tests.fuzz [SECONDS] [NAME …]`, or `make fuzz`: coverage-guided fuzzing of each target (extra `fuzz`).

Of the inputs that reached new code the last are kept in tests/fuzz/corpus; one that raises is left in
build/fuzz and ends with exit code 1. Copied into the corpus it becomes a test.
"""

import subprocess
import sys
from pathlib import Path

CORPUS = Path(__file__).parent / "corpus"
BROKEN = Path("build/fuzz")
LONGEST = 4096
KEPT = 12
"""Inputs kept of each run."""


def main(seconds="60", *names):
    from tests.fuzz.targets import TARGETS, seeds

    code = 0
    for name in names or TARGETS:
        kept, grown = CORPUS / name, BROKEN / name
        for directory in (kept, grown):
            directory.mkdir(parents=True, exist_ok=True)
        for number, seed in enumerate(seeds(name)):
            (grown / f"seed-{number}").write_bytes(seed)
        longest = max(LONGEST, *(2 * len(seed) for seed in seeds(name)))
        common = [sys.executable, "-m", "tests.fuzz", "--one", name, f"-max_len={longest}"]
        found = subprocess.run(
            [*common, f"-max_total_time={seconds}", f"-artifact_prefix={grown}-", "-timeout=20", str(grown), str(kept)],
            check=False,
        )
        code = code or found.returncode
        keep(name)
    return code


def keep(name):
    """Copy the last inputs that reached new code into the corpus: they lie deepest."""
    grown = [path for path in (BROKEN / name).iterdir() if not path.name.startswith("seed")]
    for path in sorted(grown, key=lambda path: path.stat().st_mtime)[-KEPT:]:
        (CORPUS / name / path.name).write_bytes(path.read_bytes())


def one(name, *options):
    """This process fuzzes one target."""
    import atheris

    with atheris.instrument_imports(include=["dob_companion", "sitl", "pymavlink.dialects.v20"]):
        from tests.fuzz.targets import TARGETS
    atheris.Setup([name, *options], TARGETS[name])
    atheris.Fuzz()


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        one(*sys.argv[2:])
    else:
        sys.exit(main(*sys.argv[1:]))
