"""`python -m bench [NAME …]`, or `make bench`: every measurement, or those named.

Times depend on the machine and on what else it does, so each table holds a reference measured in the same run, in turn
with the thing itself; the ratio is what may be compared between machines. With `--write` the pages of docs/ that quote
a measurement, in a block that begins with `$ python -m bench NAME`, quote this one.
"""

import argparse
import pkgutil
import re
from importlib import import_module
from pathlib import Path

import bench

DOCS = Path(__file__).parents[1] / "docs"


def main() -> None:
    names = [module.name for module in pkgutil.iter_modules(bench.__path__) if not module.name.startswith("_")]
    parser = argparse.ArgumentParser(prog="python -m bench", description="Measurements, as ratios taken in one run.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(names)} (all)")
    parser.add_argument("--write", action="store_true", help="put what is printed where docs/ quotes it")
    asked = parser.parse_args()
    for unknown in sorted({*asked.names} - {*names}):
        parser.error(f"NAME {unknown!r}: expected one of {', '.join(names)}")
    for name in asked.names or names:
        module = import_module(f"bench.{name}")
        printed = [f"{name}: {module.__doc__.partition(chr(10))[0]}"]
        print(printed[0])
        for line in module.measure():
            printed.append(f"  {line}")
            print(printed[-1], flush=True)
        if asked.write:
            quote(name, "\n".join(printed))


def quote(name: str, printed: str) -> None:
    """Replace what pages quote of a measurement by `printed`."""
    quoted = re.compile(rf"(?<=^```\n)\$ python -m bench {name}\n.*?(?=^```$)", re.DOTALL | re.MULTILINE)
    for page in sorted(DOCS.glob("*.md")):
        text = page.read_text(encoding="utf-8")
        new = quoted.sub(lambda _: f"$ python -m bench {name}\n{printed}\n", text)
        if new != text:
            page.write_text(new, encoding="utf-8")
            print(f"  -> {page.relative_to(DOCS.parent)}")


if __name__ == "__main__":
    main()
