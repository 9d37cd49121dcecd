"""The parameter protocol: what a ground station asks of our parameters, and the answers it gets."""

from dob_companion.companion.parameters import PARAMETERS, Parameters
from dob_companion.mavlink import ParamRead, ParamRefusal, ParamWrite, Sender, Speaker

WORDS_A_SECOND = 10
"""More writes than that in a second are answered all the same, and only counted in the log."""

LISTS_A_SECOND = 4
"""Requests for the whole list that are answered in a second: each brings a message for every parameter, and a flood of
them would leave no room on the line. Who gets none asks again, as the protocol has it for any message that is lost."""


class Operator:
    """Answers reads and writes. A known name is always echoed with its value as it stands, own index and count.

    A request that went to everybody and is not about us gets no answer; one that names our component and cannot be
    met gets a PARAM_ERROR.
    """

    def __init__(self, parameters: Parameters, speaker: Speaker) -> None:
        self._parameters = parameters
        self._speaker = speaker
        self._words: list[str] = []
        self._room, self._lists = WORDS_A_SECOND, LISTS_A_SECOND
        self._untold = 0

    def words(self) -> list[str]:
        """A line for each write since the last call: what it was, and who sent it."""
        words, self._words = self._words, []
        return words

    def each_second(self) -> None:
        """Room in the log, and for the lists, of another second."""
        if self._untold:
            self._words.append(f"parameters: {self._untold} more writes within a second")
        self._room, self._lists, self._untold = WORDS_A_SECOND, LISTS_A_SECOND, 0

    def answer(self, fact: ParamRead | ParamWrite) -> list[bytes]:
        """The messages that answer a request, in order."""
        if isinstance(fact, ParamWrite):
            return self._written(fact)
        if not fact.name and fact.index is None:
            if not self._lists:
                return []
            self._lists -= 1
            return [self._value(index) for index in range(len(PARAMETERS))]
        if fact.index is not None and not fact.addressed:
            return []  # an index asked of everybody means the autopilot's own list
        index = self._parameters.find(fact.name, fact.index)
        if index is not None:
            return [self._value(index)]
        asked = -1 if fact.index is None else fact.index
        return self._refused(fact.sender, fact.addressed, fact.name, asked, ParamRefusal.DOES_NOT_EXIST)

    def value(self, name: str) -> bytes:
        """A parameter of ours as it stands, for everybody."""
        return self._value([spec.name for spec in PARAMETERS].index(name))

    def _written(self, write: ParamWrite) -> list[bytes]:
        index = self._parameters.find(write.name, None)
        before = None if index is None else self._parameters[write.name]
        refusal = self._parameters.write(write)
        if index is not None or write.addressed:
            self._note(write, before, refusal)
        echo = [] if index is None else [self._value(index)]
        if refusal is None:
            return echo
        return self._refused(write.sender, write.addressed, write.name, -1, refusal) + echo

    def _note(self, write: ParamWrite, before: float | None, refusal: ParamRefusal | None) -> None:
        if not self._room:
            self._untold += 1
            return
        self._room -= 1
        if refusal is None:
            now, old = f"{self._parameters[write.name]:g}", f"{before:g}"
            what = f"{now}, was {old}" if now != old else f"{now}, as before"
        else:
            what = f"{write.value:g} refused, {refusal.name.lower().replace('_', ' ')}"
        sender = f"system {write.sender.system}, component {write.sender.component}"
        name = write.name if before is not None else repr(write.name)
        self._words.append(f"parameter {name}: {what} (written by {sender})")

    def _refused(self, to: Sender, addressed: bool, name: str, index: int, refusal: ParamRefusal) -> list[bytes]:
        return [self._speaker.param_error(to, name, index, refusal)] if addressed else []

    def _value(self, index: int) -> bytes:
        name = PARAMETERS[index].name
        return self._speaker.param_value(name, self._parameters[name], len(PARAMETERS), index)
