"""Real messages of the companion, and what a far end makes of the bytes that reach it."""

from pymavlink.dialects.v20 import common as mav

from dob_companion.mavlink import Severity, Speaker


class Talk:
    """Corrections and texts, numbered; `correction(k)` is stamped k."""

    def __init__(self):
        self.speaker = Speaker()
        self.speaker.system = 1

    def correction(self, k):
        return self.speaker.correction(k, (0.1, 0.2, 0.3))

    def text(self, k):
        return self.speaker.text(Severity.INFO, f"text {k} of a length as they have it")


class Ear:
    """A far end that must understand every byte: a part of a message fails the test."""

    def __init__(self):
        self._parser = mav.MAVLink(None)
        self._parser.robust_parsing = False
        self.stamps, self.texts = [], []

    def hear(self, data):
        for message in self._parser.parse_buffer(data) or []:  # not robust: whatever is no message raises
            assert message.get_type() != "BAD_DATA"
            if message.get_type() == "DEBUG_VECT":
                self.stamps.append(message.time_usec)
            elif message.get_type() == "STATUSTEXT" and message.text.startswith("text "):
                self.texts.append(int(message.text.split()[1]))
