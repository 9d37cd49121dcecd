"""The parameter protocol: what a ground station asks of our parameters, and the answers it gets."""

from dob_companion.companion.parameters import PARAMETERS, Parameters
from dob_companion.mavlink import ParamRead, ParamRefusal, ParamWrite, Sender, Speaker


class Operator:
    """Answers reads and writes. A known name is always echoed with its value as it stands, own index and count.

    A request that went to everybody and is not about us gets no answer; one that names our component and cannot be
    met gets a PARAM_ERROR.
    """

    def __init__(self, parameters: Parameters, speaker: Speaker) -> None:
        self._parameters = parameters
        self._speaker = speaker

    def answer(self, fact: ParamRead | ParamWrite) -> list[bytes]:
        """The messages that answer a request, in order."""
        if isinstance(fact, ParamWrite):
            return self._written(fact)
        if not fact.name and fact.index is None:
            return [self._value(index) for index in range(len(PARAMETERS))]
        if fact.index is not None and not fact.addressed:
            return []  # an index asked of everybody means the autopilot's own list
        index = self._parameters.find(fact.name, fact.index)
        if index is not None:
            return [self._value(index)]
        asked = -1 if fact.index is None else fact.index
        return self._refused(fact.sender, fact.addressed, fact.name, asked, ParamRefusal.DOES_NOT_EXIST)

    def _written(self, write: ParamWrite) -> list[bytes]:
        refusal = self._parameters.write(write)
        index = self._parameters.find(write.name, None)
        echo = [] if index is None else [self._value(index)]
        if refusal is None:
            return echo
        return self._refused(write.sender, write.addressed, write.name, -1, refusal) + echo

    def _refused(self, to: Sender, addressed: bool, name: str, index: int, refusal: ParamRefusal) -> list[bytes]:
        return [self._speaker.param_error(to, name, index, refusal)] if addressed else []

    def _value(self, index: int) -> bytes:
        name = PARAMETERS[index].name
        return self._speaker.param_value(name, self._parameters[name], len(PARAMETERS), index)
