"""Process data of an emulated drive: frames laid out as the mapping parameters say, exchanged at SYNC."""

from functools import partial

from sim_backend.canopen_bus.object_dictionary import Abort, AbortError, ObjectDictionary

RECEIVED = (0x1400, 0x1600)
SENT = (0x1800, 0x1A00)
PDOS = 4
ENTRIES = 8
_FRAME_BYTES = 8
_OFF = 1 << 31
_HIGHEST_SYNCHRONOUS = 240


class ProcessData:
    """The PDOs of one node; RPDOs wait for SYNC, TPDOs are sampled at it."""

    def __init__(self, dictionary: ObjectDictionary, node_id: int) -> None:
        """Add the communication and mapping parameters; all PDOs are off at power-up.

        Parameters
        ----------
        dictionary : ObjectDictionary
            of the node
        node_id : int
            1 to 127
        """
        self._dictionary = dictionary
        self._waiting: dict[int, bytes] = {}
        self._syncs = 0
        for (communication, mapping), first_id in ((RECEIVED, 0x200), (SENT, 0x180)):
            for number in range(PDOS):
                dictionary.add(communication + number, 0, 1, 2, writable=False)
                dictionary.add(communication + number, 1, 4, _OFF | first_id + 0x100 * number + node_id)
                dictionary.add(communication + number, 2, 1, 255)
                dictionary.add(mapping + number, 0, 1, hook=partial(self._require_fit, mapping + number))
                require_mappable = partial(self._require_mappable, mapping + number)
                for subindex in range(1, ENTRIES + 1):
                    dictionary.add(mapping + number, subindex, 4, hook=require_mappable)

    def take(self, identifier: int, payload: bytes) -> bool:
        """Keep a frame for the next SYNC; False where it is no RPDO of this node.

        Parameters
        ----------
        identifier : int
            of the frame
        payload : bytes
            of the frame
        """
        for number in range(PDOS):
            if self._identifier(RECEIVED[0] + number) == identifier:
                if self._dictionary.get(RECEIVED[0] + number, 2) <= _HIGHEST_SYNCHRONOUS:
                    self._waiting[number] = payload
                else:
                    self._apply(number, payload)
                return True
        return False

    def synchronise(self) -> list[tuple[int, bytes]]:
        """Apply what waited, and sample the frames that this SYNC asks for: identifiers and payloads."""
        for number, payload in sorted(self._waiting.items()):
            self._apply(number, payload)
        self._waiting.clear()
        self._syncs += 1
        frames = []
        for number in range(PDOS):
            identifier = self._identifier(SENT[0] + number)
            every = self._dictionary.get(SENT[0] + number, 2)
            if identifier is not None and 1 <= every <= _HIGHEST_SYNCHRONOUS and self._syncs % every == 0:
                frames.append((identifier, self._sample(number)))
        return frames

    def _identifier(self, communication: int) -> int | None:
        """Identifier of a PDO; None where it is off."""
        identifier = self._dictionary.get(communication, 1)
        return None if identifier & _OFF else identifier & 0x7FF

    def _entries(self, mapping: int) -> list[tuple[int, int, int]]:
        """Index, subindex and bytes of what a PDO holds."""
        words = self._words(mapping, self._dictionary.get(mapping, 0))
        return [(word >> 16, word >> 8 & 0xFF, (word & 0xFF) // 8) for word in words]

    def _words(self, mapping: int, count: int) -> list[int]:
        """The first entries of a mapping, as they were written."""
        return [self._dictionary.get(mapping, subindex) for subindex in range(1, count + 1)]

    def _require_mappable(self, mapping: int, word: int) -> None:
        """An entry is changed while none counts, and names an object of the node with its length."""
        if self._dictionary.get(mapping, 0) != 0:
            raise AbortError(Abort.DEVICE_STATE)
        entry = self._dictionary.entries.get((word >> 16, word >> 8 & 0xFF))
        if entry is None or 8 * entry.bytes != word & 0xFF:
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

    def _apply(self, number: int, payload: bytes) -> None:
        """Write what a frame holds, as a master would; one of the wrong length is dropped."""
        entries = self._entries(RECEIVED[1] + number)
        if len(payload) != sum(size for _, _, size in entries):
            return
        start = 0
        for index, subindex, size in entries:
            try:
                self._dictionary.write(index, subindex, payload[start : start + size])
            except AbortError:
                return
            start += size

    def _sample(self, number: int) -> bytes:
        """Payload of a TPDO."""
        return b"".join(
            self._dictionary.read(index, subindex) for index, subindex, _ in self._entries(SENT[1] + number)
        )
