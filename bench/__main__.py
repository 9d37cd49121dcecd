"""`python -m bench [NAME …]`, or `make bench`: every measurement, or those named.

Times depend on the machine and on what else it does, so each table holds a reference measured in the same run, in turn
with the thing itself; the ratio is what may be compared between machines.
"""

import argparse
import pkgutil
from importlib import import_module

import bench


def main() -> None:
    names = [module.name for module in pkgutil.iter_modules(bench.__path__) if not module.name.startswith("_")]
    parser = argparse.ArgumentParser(prog="python -m bench", description="Measurements, as ratios taken in one run.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(names)} (all)")
    asked = parser.parse_args().names
    for unknown in sorted({*asked} - {*names}):
        parser.error(f"NAME {unknown!r}: expected one of {', '.join(names)}")
    for name in asked or names:
        module = import_module(f"bench.{name}")
        print(f"{name}: {module.__doc__.partition(chr(10))[0]}")
        for line in module.measure():
            print(f"  {line}")


if __name__ == "__main__":
    main()
