"""What the companion has said and nobody has taken yet, and which of it answers samples."""

from dob_companion.companion.dob import Answer


class Outgoing:
    """Messages to send, oldest first."""

    def __init__(self) -> None:
        self._messages: list[bytes] = []
        self._answers: list[tuple[Answer, bytes]] = []

    def put(self, *messages: bytes) -> None:
        """Messages are to go out."""
        self._messages.extend(messages)

    def answer(self, answer: Answer, message: bytes) -> None:
        """A message is to go out that answers a sample."""
        self._messages.append(message)
        self._answers.append((answer, message))

    def leave_out_before(self, stamp_us: int) -> None:
        """Of the samples of a backlog only the newest are answered, unless by zero: what an older one asks for is
        older than the design allows, and the vehicle takes the newest in any case."""
        old = [message for answer, message in self._answers if answer.stamp_us < stamp_us and any(answer.correction)]
        if old:
            self._messages = [message for message in self._messages if message not in old]
            self._answers = [kept for kept in self._answers if kept[1] not in old]

    def take(self) -> tuple[list[bytes], int | None]:
        """The messages, which are gone from here then, and the stamp of the newest sample that they answer."""
        newest = self._answers[-1][0].stamp_us if self._answers else None
        messages, self._messages = self._messages, []
        self._answers.clear()
        return messages, newest
