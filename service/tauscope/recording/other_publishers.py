"""Messages on a topic that are not of the wanted joints, or lack their positions or efforts: left out and counted."""

from collections.abc import Sequence

from tauscope.errors import RecordingError, RecordingMismatchError
from tauscope.recording.words import listed
from tauscope.result_warning import ResultWarning

_REMEDY = "record with one publisher on the topic, or choose another topic with --topic"


class OtherPublishers:
    """Counts a topic's messages of others."""

    def __init__(self) -> None:
        """Start without any."""
        self._foreign: dict[tuple[str, ...], int] = {}
        self._partial: dict[tuple[str, ...], int] = {}
        self._incomplete: dict[tuple[str, tuple[str, ...]], int] = {}

    def add(self, names: Sequence[str], wanted: Sequence[str], count: int) -> None:
        """Messages that lack some of the wanted joints, or all of them."""
        kind = self._partial if set(names) & set(wanted) else self._foreign
        kind[tuple(names)] = kind.get(tuple(names), 0) + count

    def add_incomplete(self, names: Sequence[str], missing: str, count: int) -> None:
        """Messages without positions, or without efforts."""
        key = missing, tuple(names)
        self._incomplete[key] = self._incomplete.get(key, 0) + count

    def notes(self, topic: str, wanted: Sequence[str]) -> tuple[ResultWarning, ...]:
        """Warnings about messages that name wanted joints; a gripper's own messages are none of the arm's business."""
        texts = [
            f"{_messages(count)} no {missing}; left out"
            for (missing, names), count in self._incomplete.items()
            if not names or set(names) & set(wanted)
        ]
        texts += [
            f"{_messages(count)} only the joints {listed(names)}; left out" for names, count in self._partial.items()
        ]
        return tuple(
            ResultWarning(code="other-publisher", text=f"topic {topic}: {text}", remedy=_REMEDY) for text in texts
        )

    def error(self, place: str, wanted: Sequence[str] | None) -> RecordingError:
        """The reason why no message was of use."""
        if self._incomplete:
            missing, _ = next(iter(self._incomplete))
            return RecordingError(f"{place}: carries no {missing}; record position and effort of every joint")
        found = max((*self._partial.items(), *self._foreign.items()), key=lambda entry: entry[1], default=((), 0))[0]
        names = wanted or ()
        missing = [name for name in names if name not in found]
        lacks = f": {listed(missing)} is missing" if self._partial else ""
        return RecordingMismatchError(
            f"{place} carries {len(found)} joints ({listed(found)}), the robot has {len(names)} ({listed(names)})"
            f"{lacks}; name the joints in the robot file as the recording does"
        )


def _messages(count: int) -> str:
    """A count of messages, up to the verb."""
    return "1 message holds" if count == 1 else f"{count} messages hold"
