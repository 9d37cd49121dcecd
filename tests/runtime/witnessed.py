"""A process that serves one companion on a UDP port, given as its argument, with a witness that fails in flight.

Events stand on standard output, one a line, and how many turns the failing witness has seen since it failed.
"""

import sys
from contextlib import closing

from dob_companion.companion import Companion, parse_config
from dob_companion.flightlog.witness import Witness
from dob_companion.runtime import open_link, parse_link_url, serve
from tests.companion.aircraft import small_design


class Failing(Witness):
    """Raises whenever it hears that the correction is fully in, or anything after that."""

    def __init__(self):
        self.failed, self.told_since = False, 0

    def said(self, messages):  # noqa: ARG002
        self._fail()

    def event(self, event):
        if event.change and event.change.target.name == "ACTIVE":
            self.failed = True
            self._fail()

    def turned(self, companion, now, took_s):  # noqa: ARG002
        self._fail()
        return ""

    def _fail(self):
        if self.failed:
            self.told_since += 1
            raise ZeroDivisionError("a mistake\nof this program")


class Log(Witness):
    """Prints events."""

    def event(self, event):
        print(event.text, flush=True)


if __name__ == "__main__":
    url, failing = parse_link_url(f"udpin:127.0.0.1:{sys.argv[1]}"), Failing()
    with closing(open_link(url)) as link:
        companion = Companion(small_design(), parse_config("", "none"))
        code = serve(companion, link, witnesses=[failing, Log()])
    print(f"told since it failed: {failing.told_since}", flush=True)
    sys.exit(code)
