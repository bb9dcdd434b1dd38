"""Process data of an emulated drive: frames laid out as the mapping parameters say, exchanged at SYNC."""

from dataclasses import dataclass
from functools import partial

from tauscope_sim.canopen_bus.object_dictionary import Abort, AbortError, Entry, ObjectDictionary

PDOS = 4
ENTRIES = 8
_FRAME_BYTES = 8
_TO_MAPPING = 0x200
_OFF = 1 << 31
_HIGHEST_SYNCHRONOUS = 240


@dataclass(frozen=True)
class _Pdo:
    """Where a PDO's identifier, its transmission type and what it holds are written."""

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
        add, mapping = self._dictionary.add, communication + _TO_MAPPING
        add(communication, 0, 1, 2, writable=False)
        cob_id = add(communication, 1, 4, _OFF | identifier)
        transmission = add(communication, 2, 1, 255)
        add(mapping, 0, 1, hook=partial(self._require_fit, mapping))
        for subindex in range(1, ENTRIES + 1):
            add(mapping, subindex, 4, hook=partial(self._require_mappable, mapping))
        return _Pdo(cob_id, transmission, mapping)

    def take(self, identifier: int, payload: bytes) -> bool:
        """Keep a frame for the next SYNC; False where it is no RPDO of this node."""
        for number, pdo in enumerate(self._received):
            if pdo.identifier == identifier:
                if pdo.transmission.value <= _HIGHEST_SYNCHRONOUS:
                    self._waiting[number] = payload
                else:
                    self._apply(pdo, payload)
                return True
        return False

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
        words = self._words(mapping, self._dictionary.get(mapping, 0))
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
