"""Which answers of a group belong to the question that was just asked."""

from collections.abc import Collection, Sequence

from tauscope_drivers.dynamixel.packets import Status


class Turns:
    """Keeps the answers of a Sync Read apart from late answers to an earlier one, which look the same.

    Servos answer in turn. An answer that comes out of turn says that it, or one before it, is a late one: both are let
    go. So are two answers of one servo that differ; of two that are equal, one is kept. Servos that owe an answer to
    an earlier question are not believed among themselves: what comes from nobody else is likely what they owe.
    """

    def __init__(self, servos: Sequence[int], owed: Collection[int] = ()) -> None:
        """Nothing has come yet."""
        self._place = {servo: place for place, servo in enumerate(servos)}
        self._owed = frozenset(owed)
        self._found: dict[int, Status] = {}
        self._contradicted: set[int] = set()
        self._heard: set[int] = set()
        self._last = -1

    @property
    def complete(self) -> bool:
        """Whether every servo has answered."""
        return len(self._found) + len(self._contradicted) >= len(self._place)

    @property
    def answers(self) -> dict[int, Status]:
        """What can be believed, by ID."""
        return {} if self._found.keys() <= self._owed else dict(self._found)

    @property
    def unheard(self) -> set[int]:
        """Servos of which nothing has come, be it believed or not."""
        return self._place.keys() - self._heard

    def take(self, status: Status) -> None:
        """Take an answer."""
        servo = status.servo
        place = self._place.get(servo)
        if place is not None:
            self._heard.add(servo)
        if place is None or servo in self._contradicted or self._found.get(servo) == status:
            return
        if servo in self._found:
            del self._found[servo]
            self._contradicted.add(servo)
            return
        if place > self._last:
            self._found[servo] = status
        else:
            self._found = {other: kept for other, kept in self._found.items() if self._place[other] < place}
        self._last = place
