"""Expedited SDOs, as an emulated drive answers it (CiA 301): all its entries fit into four bytes."""

from tauscope_sim.canopen_bus.object_dictionary import Abort, AbortError, ObjectDictionary

_UPLOAD = 0x40
_DOWNLOAD = 0x20
_DOWNLOAD_DONE = 0x60
_ABORT = 0x80
_COMMAND = 0xE0


def answer_request(dictionary: ObjectDictionary, request: bytes) -> bytes | None:
    """Answer to a request; None where the frame is no request."""
    if len(request) != 8 or request[0] & _COMMAND == _ABORT:
        return None
    index, subindex = int.from_bytes(request[1:3], "little"), request[3]
    try:
        return _answer(dictionary, request, index, subindex)
    except AbortError as refusal:
        return bytes([_ABORT]) + request[1:4] + int(refusal.code).to_bytes(4, "little")


def _answer(dictionary: ObjectDictionary, request: bytes, index: int, subindex: int) -> bytes:
    """Answer to an upload or an expedited download."""
    command = request[0] & _COMMAND
    if command == _UPLOAD:
        data = dictionary.read(index, subindex)
        head = 0x43 | (4 - len(data)) << 2
        return bytes([head]) + request[1:4] + data.ljust(4, b"\0")
    is_expedited = request[0] & 0x02
    if command != _DOWNLOAD or not is_expedited:
        raise AbortError(Abort.UNKNOWN_COMMAND)
    has_size = request[0] & 0x01
    size = 4 - (request[0] >> 2 & 0x03) if has_size else 4
    dictionary.write(index, subindex, request[4 : 4 + size])
    return bytes([_DOWNLOAD_DONE]) + request[1:4] + bytes(4)
