"""The object dictionary of an emulated drive: entries with a size, a value and who may write them."""

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import IntEnum


class Abort(IntEnum):
    """Abort codes of SDO transfers, CiA 301."""

    UNKNOWN_COMMAND = 0x05040001
    WRITE_ONLY = 0x06010001
    READ_ONLY = 0x06010002
    NO_OBJECT = 0x06020000
    NOT_MAPPABLE = 0x06040041
    TOO_MUCH_MAPPED = 0x06040042
    WRONG_LENGTH = 0x06070010
    NO_SUBINDEX = 0x06090011
    VALUE_RANGE = 0x06090030
    DEVICE_STATE = 0x08000022


class AbortError(Exception):
    """A transfer is refused."""

    def __init__(self, code: Abort) -> None:
        super().__init__(code.name)
        self.code = code


WriteHook = Callable[[int], None]
"""Called with a new value before it is kept; raises `AbortError` where the drive does not take it."""


@dataclass
class Entry:
    """One entry; one that is not visible is the drive's own, as if a master had never heard of it."""

    bytes: int
    value: int = 0
    signed: bool = False
    writable: bool = True
    hook: WriteHook | None = None
    is_visible: bool = True


@dataclass
class ObjectDictionary:
    """All entries, by index and subindex.

    entries : dict
        of (index, subindex) to Entry
    """

    entries: dict[tuple[int, int], Entry] = field(default_factory=dict)

    def add(
        self,
        index: int,
        subindex: int,
        size: int,
        value: int = 0,
        *,
        signed: bool = False,
        writable: bool = True,
        hook: WriteHook | None = None,
    ) -> Entry:
        """Add an entry.

        Parameters
        ----------
        size : int
            1, 2 or 4 [bytes]
        """
        entry = self.entries[index, subindex] = Entry(size, value, signed, writable, hook)
        return entry

    def get(self, index: int, subindex: int = 0) -> int:
        """Value of an entry."""
        try:
            return self.entries[index, subindex].value
        except KeyError:
            raise self._missing(index, subindex) from None

    def put(self, index: int, value: int, subindex: int = 0) -> None:
        """Set an entry from within the drive, whoever may write it."""
        entry = self._entry(index, subindex)
        bits = 8 * entry.bytes
        low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if entry.signed else (0, (1 << bits) - 1)
        entry.value = min(max(value, low), high)

    def read(self, index: int, subindex: int) -> bytes:
        """Value of an entry as a master gets it, little end first. Raises AbortError where there is no such entry."""
        self._visible(index, subindex)
        return self.encode(index, subindex)

    def encode(self, index: int, subindex: int) -> bytes:
        """Value of an entry as the drive itself sends it, little end first."""
        entry = self._entry(index, subindex)
        return entry.value.to_bytes(entry.bytes, "little", signed=entry.signed)

    def write(self, index: int, subindex: int, data: bytes) -> None:
        """A master's write.

        Raises AbortError where there is no such entry, it is not writable, the length is wrong, or the drive refuses
        the value.
        """
        entry = self._visible(index, subindex)
        if not entry.writable:
            raise AbortError(Abort.READ_ONLY)
        if len(data) != entry.bytes:
            raise AbortError(Abort.WRONG_LENGTH)
        value = int.from_bytes(data, "little", signed=entry.signed)
        if entry.hook is not None:
            entry.hook(value)
        entry.value = value

    def has(self, index: int, subindex: int = 0) -> bool:
        """Whether a master finds an entry."""
        return (index, subindex) in self.entries and self.entries[index, subindex].is_visible

    def _visible(self, index: int, subindex: int) -> Entry:
        if not self.has(index, subindex):
            raise self._missing(index, subindex)
        return self.entries[index, subindex]

    def _entry(self, index: int, subindex: int) -> Entry:
        try:
            return self.entries[index, subindex]
        except KeyError:
            raise self._missing(index, subindex) from None

    def _missing(self, index: int, subindex: int) -> AbortError:
        """What a master is told that asks for an entry that does not exist."""
        known = any(place[0] == index and entry.is_visible for place, entry in self.entries.items())
        return AbortError(Abort.NO_SUBINDEX if known else Abort.NO_OBJECT)
