"""The object dictionary of an emulated drive, read and written by SDO, and the process data that it maps."""

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import IntEnum
from functools import partial

from tauscope_drivers.canopen.data_sheet.device_file import DeviceFile


class Abort(IntEnum):
    """Abort codes of SDO transfers, CiA 301."""

    UNKNOWN_COMMAND = 0x05040001
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


# called with a new value before it is kept; raises `AbortError` where the drive does not take it
WriteHook = Callable[[int], None]


@dataclass
class Entry:
    """One entry; one that is not visible is the drive's own, as if a master had never heard of it."""

    bytes: int  # 1, 2 or 4
    value: int = 0
    signed: bool = False
    writable: bool = True
    hook: WriteHook | None = None
    is_visible: bool = True


@dataclass
class ObjectDictionary:
    """All entries, by index and subindex."""

    entries: dict[tuple[int, int], Entry] = field(default_factory=dict)  # of (index, subindex) to Entry

    def get(self, index: int, subindex: int = 0) -> int:
        """Value of an entry."""
        return self._find(index, subindex).value

    def put(self, index: int, value: int, subindex: int = 0) -> None:
        """Set an entry from within the drive, whoever may write it."""
        entry = self._find(index, subindex)
        bits = 8 * entry.bytes
        low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if entry.signed else (0, (1 << bits) - 1)
        entry.value = min(max(value, low), high)

    def encode(self, index: int, subindex: int, *, by_master: bool = False) -> bytes:
        """Value of an entry, little end first, as the drive or a master has it. Raises AbortError without an entry."""
        entry = self._find(index, subindex, by_master=by_master)
        return entry.value.to_bytes(entry.bytes, "little", signed=entry.signed)

    def write(self, index: int, subindex: int, data: bytes) -> None:
        """A master's write. Raises AbortError: no such entry, not writable, a wrong length, or refused."""
        entry = self._find(index, subindex, by_master=True)
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

    def _find(self, index: int, subindex: int, *, by_master: bool = False) -> Entry:
        entry = self.entries.get((index, subindex))
        if entry is None or (by_master and not entry.is_visible):
            known = any(place[0] == index and entry.is_visible for place, entry in self.entries.items())
            raise AbortError(Abort.NO_SUBINDEX if known else Abort.NO_OBJECT)
        return entry


_UPLOAD, _DOWNLOAD, _DOWNLOAD_DONE, _ABORT = 0x40, 0x20, 0x60, 0x80
_COMMAND = 0xE0


def answer_request(dictionary: ObjectDictionary, request: bytes) -> bytes | None:
    """Answer to a request; None where the frame is no request."""
    command = request[0] & _COMMAND if len(request) == 8 else _ABORT
    if command == _ABORT:
        return None
    index, subindex = int.from_bytes(request[1:3], "little"), request[3]
    try:
        if command == _UPLOAD:
            data = dictionary.encode(index, subindex, by_master=True)
            return bytes([0x43 | (4 - len(data)) << 2]) + request[1:4] + data.ljust(4, b"\0")
        if command != _DOWNLOAD or not request[0] & 0x02:  # expedited ones alone
            raise AbortError(Abort.UNKNOWN_COMMAND)
        size = 4 - (request[0] >> 2 & 0x03) if request[0] & 0x01 else 4
        dictionary.write(index, subindex, request[4 : 4 + size])
        return bytes([_DOWNLOAD_DONE]) + request[1:4] + bytes(4)
    except AbortError as refusal:
        return bytes([_ABORT]) + request[1:4] + int(refusal.code).to_bytes(4, "little")


# bytes of a data type, and whether it is signed; longer ones are left out
_SIZES = {
    **{name: (size, False) for name, size in (("BOOLEAN", 1), ("UNSIGNED8", 1), ("UNSIGNED16", 2), ("UNSIGNED32", 4))},
    **{name: (size, True) for name, size in (("INTEGER8", 1), ("INTEGER16", 2), ("INTEGER32", 4))},
}
_PROCESS_DATA = range(0x1400, 0x1C00)
_IDENTITY = 0x1018
# objects whose value is the maker's; what the drive measures or is told is the emulator's own
_STATED = (0x6076, 0x6502)


def apply_sheet(dictionary: ObjectDictionary, file: DeviceFile) -> None:
    """Hide the entries that a file does not have, add those that it has, and let its access rights hold."""
    for place, entry in dictionary.entries.items():
        entry.is_visible = place in file.objects
    for (index, subindex), described in file.objects.items():
        size, signed = _SIZES.get(described.type_name, (0, False))
        if not size:
            continue
        is_own = (index, subindex) in dictionary.entries
        entry = dictionary.entries.setdefault((index, subindex), Entry(size))
        entry.bytes, entry.signed, entry.writable = size, signed, "w" in described.access
        data = described.value
        value = described.default if data is None else int.from_bytes(data, "little", signed=signed)
        if value is not None and (not is_own or index in _PROCESS_DATA or (index in _STATED and value)):
            dictionary.put(index, value, subindex)
    for subindex, number in enumerate((file.vendor, file.product, file.revision), 1):
        if dictionary.has(_IDENTITY, subindex) and number is not None:
            dictionary.put(_IDENTITY, number, subindex)


PDOS = 4
ENTRIES = 8
_FRAME_BYTES = 8
_TO_MAPPING = 0x200
_OFF = 1 << 31
_HIGHEST_SYNCHRONOUS = 240


@dataclass(frozen=True)
class _Pdo:
    cob_id: Entry
    transmission: Entry
    mapping: int

    @property
    def identifier(self) -> int | None:
        word = self.cob_id.value
        return None if word & _OFF else word & 0x7FF


class ProcessData:
    """The PDOs of one node; RPDOs wait for SYNC, TPDOs are sampled at it."""

    def __init__(self, dictionary: ObjectDictionary, node_id: int) -> None:
        self._dictionary = dictionary
        self._waiting: dict[int, bytes] = {}
        self._syncs = 0
        self._received = [self._add(0x1400 + number, 0x200 + 0x100 * number + node_id) for number in range(PDOS)]
        self._sent = [self._add(0x1800 + number, 0x180 + 0x100 * number + node_id) for number in range(PDOS)]

    def _add(self, communication: int, identifier: int) -> _Pdo:
        entries, mapping = self._dictionary.entries, communication + _TO_MAPPING
        entries[communication, 0] = Entry(1, 2, writable=False)
        entries[communication, 1] = cob_id = Entry(4, _OFF | identifier)
        entries[communication, 2] = transmission = Entry(1, 255)
        entries[mapping, 0] = Entry(1, hook=partial(self._require_fit, mapping))
        for subindex in range(1, ENTRIES + 1):
            entries[mapping, subindex] = Entry(4, hook=partial(self._require_mappable, mapping))
        return _Pdo(cob_id, transmission, mapping)

    def take(self, identifier: int, payload: bytes) -> None:
        """Keep a frame for the next SYNC where it is an RPDO of this node."""
        for number, pdo in enumerate(self._received):
            if pdo.identifier == identifier:
                if pdo.transmission.value <= _HIGHEST_SYNCHRONOUS:
                    self._waiting[number] = payload
                else:
                    self._apply(pdo, payload)
                return

    def synchronise(self) -> list[tuple[int, bytes]]:
        """Apply what waited, and sample the frames that this SYNC asks for: identifiers and payloads."""
        for number, payload in sorted(self._waiting.items()):
            self._apply(self._received[number], payload)
        self._waiting.clear()
        self._syncs += 1
        frames: list[tuple[int, bytes]] = []
        for pdo in self._sent:
            identifier, every = pdo.identifier, pdo.transmission.value
            if identifier is not None and 1 <= every <= _HIGHEST_SYNCHRONOUS and self._syncs % every == 0:
                frames.append((identifier, self._sample(pdo)))
        return frames

    def _entries(self, mapping: int) -> list[tuple[int, int, int]]:
        words = self._words(mapping, self._dictionary.get(mapping))
        return [(word >> 16, word >> 8 & 0xFF, (word & 0xFF) // 8) for word in words]

    def _words(self, mapping: int, count: int) -> list[int]:
        return [self._dictionary.get(mapping, subindex) for subindex in range(1, count + 1)]

    def _require_mappable(self, mapping: int, word: int) -> None:
        """An entry is changed while none counts, and names an object of the node with its length."""
        if self._dictionary.get(mapping, 0) != 0:
            raise AbortError(Abort.DEVICE_STATE)
        entry = self._dictionary.entries.get((word >> 16, word >> 8 & 0xFF))
        if entry is None or not entry.is_visible or 8 * entry.bytes != word & 0xFF:
            raise AbortError(Abort.NOT_MAPPABLE)

    def _require_fit(self, mapping: int, count: int) -> None:
        """As many entries as there are, which together fit into a frame."""
        if count > ENTRIES:
            raise AbortError(Abort.VALUE_RANGE)
        words = self._words(mapping, count)
        if 0 in words:
            raise AbortError(Abort.NOT_MAPPABLE)
        if sum(word & 0xFF for word in words) > 8 * _FRAME_BYTES:
            raise AbortError(Abort.TOO_MUCH_MAPPED)

    def _apply(self, pdo: _Pdo, payload: bytes) -> None:
        """Write what a frame holds, as a master would; one of the wrong length is dropped."""
        entries = self._entries(pdo.mapping)
        if len(payload) != sum(size for _, _, size in entries):
            return
        start = 0
        for index, subindex, size in entries:
            try:
                self._dictionary.write(index, subindex, payload[start : start + size])
            except AbortError:
                return
            start += size

    def _sample(self, pdo: _Pdo) -> bytes:
        return b"".join(self._dictionary.encode(index, subindex) for index, subindex, _ in self._entries(pdo.mapping))
