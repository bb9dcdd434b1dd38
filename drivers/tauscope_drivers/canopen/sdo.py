"""SDOs: a node's object dictionary, read and written; lost, late and doubled answers are made up for."""

import time
from collections.abc import Callable, Mapping
from typing import Protocol, TypeVar

import can
from canopen.objectdictionary import ObjectDictionary
from canopen.sdo.client import SdoClient
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError, SdoError

from tauscope_drivers.canopen.objects import DriveObject
from tauscope_drivers.errors import DriverError

_OTHER_DRIVE = "check that drive.eds and the firmware are those of this drive"
_OTHER_VALUE = "see the drive's manual for the values that it takes, and correct the robot file's limits or its DCF"
_OTHER_STATE = "let go of the drive's power (tauscope release), close the maker's tool, and try again"

_MEANINGS: Mapping[int, tuple[str, str]] = {
    0x05040001: ("the drive does not know the transfer's command", _OTHER_DRIVE),
    0x05040005: ("the drive is out of memory", "restart the drive"),
    0x06010000: ("the drive does not give access to it", _OTHER_DRIVE),
    0x06010001: ("the drive lets it be written only", _OTHER_DRIVE),
    0x06010002: ("the drive lets it be read only", _OTHER_DRIVE),
    0x06020000: ("the drive has no such object", _OTHER_DRIVE),
    0x06040041: ("the drive cannot map this object to a PDO", "name its EDS file as drive.eds"),
    0x06040042: ("the drive's PDO would be too long", "name its EDS file as drive.eds"),
    0x06040043: ("the drive finds its parameters incompatible", _OTHER_VALUE),
    0x06040047: ("the drive has an internal incompatibility", "restart the drive"),
    0x06060000: ("the drive has a hardware error", "see the drive's own display"),
    0x06070010: ("the object has another length", _OTHER_DRIVE),
    0x06070012: ("the object is shorter", _OTHER_DRIVE),
    0x06070013: ("the object is longer", _OTHER_DRIVE),
    0x06090011: ("the drive has no such subindex", _OTHER_DRIVE),
    0x06090030: ("the drive does not take this value", _OTHER_VALUE),
    0x06090031: ("the value is too high for the drive", _OTHER_VALUE),
    0x06090032: ("the value is too low for the drive", _OTHER_VALUE),
    0x06090036: ("the drive's upper limit would be below its lower one", _OTHER_VALUE),
    0x08000000: ("the drive states a general error", "see the drive's own display"),
    0x08000020: ("the drive cannot store it", _OTHER_STATE),
    0x08000021: ("another program controls the drive", _OTHER_STATE),
    0x08000022: ("the drive does not take it in its present state", _OTHER_STATE),
}


_UNKNOWN = ("the drive aborts the transfer", "see the drive's manual for the code")

SDO_TIMEOUT_S = 0.3
ATTEMPTS = 2  # a question is asked so many times in a transfer; each answer is waited for as long as `SDO_TIMEOUT_S`

# a transfer that does not succeed is begun so many times: a request or an answer may have been altered on its way
TRANSFERS = 2
_INITIATE = {1: 3, 2: 2}  # command of a request that begins a download or an upload, and of its answer (CiA 301)

_ABORT = 4
_WRITES = 2
_READINGS = 3


_Answer = TypeVar("_Answer")


class Pump(Protocol):
    """What takes frames off the bus and hands them to whoever waits for them."""

    def receive(self, deadline_ns: int) -> bool:
        """Wait for one frame; False where none came."""
        ...


class NodeDictionary:
    """The object dictionary of one node, read and written by SDO."""

    def __init__(self, client: SdoClient, node_id: int) -> None:
        self._client = client
        self.node_id = node_id

    def read(self, entry: DriveObject) -> int:
        """Value of an entry. Raises DriverError: ``cannot-connect``: no answer; ``refused``: there is no such entry."""
        return int.from_bytes(self.read_data(entry), "little", signed=entry.signed)

    def read_surely(self, entry: DriveObject) -> int:
        """Value of an entry that all hangs on: as two readings in a row have it. Raises DriverError as `read` does."""
        values = [self.read(entry)]
        for _ in range(_READINGS):
            values.append(self.read(entry))
            if values[-1] == values[-2]:
                return values[-1]
        raise DriverError.no_connection(
            f"node {self.node_id}: {entry} reads {', '.join(map(str, values))}; check the wiring and the adapter"
        )

    def read_data(self, entry: DriveObject) -> bytes:
        """Value of an entry, cut to its size, a text without its zeros. Raises DriverError as `read` does."""
        try:
            data = bytes(_retry_transfer(lambda: self._client.upload(entry.index, entry.subindex)))
        except (SdoError, can.CanError, OSError) as error:
            raise self._failure(f"{entry} cannot be read", error) from error
        return data[: entry.bits // 8] if entry.bits else data.rstrip(b"\0")

    def read_optional(self, entry: DriveObject) -> int | None:
        """Value of an entry that not every drive has; None where the drive has none."""
        try:
            return self.read(entry)
        except DriverError as error:
            if isinstance(error.__cause__, SdoCommunicationError):
                raise
            return None

    def read_text(self, entry: DriveObject) -> str:
        """A text; empty where the node has none."""
        try:
            return self._client.upload(entry.index, entry.subindex).decode("ascii", "replace").strip("\0 ")
        except (SdoError, can.CanError, OSError):
            return ""

    def write(self, entry: DriveObject, value: int) -> None:
        """Write an entry and read it back. Raises DriverError: ``refused``: not kept; ``cannot-connect``: no answer."""
        kept = None
        for _ in range(_WRITES):
            self.send(entry, value)
            kept = self.read(entry)
            if kept == value:
                return
        raise DriverError.refusal(
            f"node {self.node_id}: {entry} was written as {value} and reads {kept}; the drive limits or forbids it"
        )

    def send(self, entry: DriveObject, value: int) -> None:
        """Write an entry that cannot be read back yet. Raises DriverError: ``cannot-connect`` or ``refused``."""
        self.send_data(entry, value.to_bytes(entry.bits // 8, "little", signed=entry.signed), str(value))

    def send_data(self, entry: DriveObject, data: bytes, text: str) -> None:
        """Write an entry as transferred. Raises DriverError: ``cannot-connect``: no answer; ``refused``: forbidden."""
        try:
            _retry_transfer(lambda: self._client.download(entry.index, entry.subindex, data))
        except (SdoError, can.CanError, OSError) as error:
            raise self._failure(f"{entry} = {text} cannot be written", error) from error

    def _failure(self, what: str, error: Exception) -> DriverError:
        if isinstance(error, SdoAbortedError):
            meaning, remedy = _MEANINGS.get(error.code, _UNKNOWN)
            return DriverError.refusal(f"node {self.node_id}: {what}: {meaning} (abort 0x{error.code:08X}); {remedy}")
        return DriverError.no_connection(
            f"node {self.node_id}: {what} ({' '.join(str(error).split())}); check node number, power and wiring"
        )


def _retry_transfer(transfer: Callable[[], _Answer]) -> _Answer:
    """What a transfer comes to, which is begun again where it fails."""
    for _ in range(TRANSFERS - 1):
        try:
            return transfer()
        except SdoError:
            continue
    return transfer()


class PumpedSdoClient(SdoClient):
    """The library's SDO client without a receiving thread; drops what does not answer the last question."""

    RESPONSE_TIMEOUT = SDO_TIMEOUT_S
    MAX_RETRIES = ATTEMPTS

    def __init__(self, pump: Pump, node_id: int) -> None:
        super().__init__(0x600 + node_id, 0x580 + node_id, ObjectDictionary())
        self._pump = pump
        self._asked: bytes | None = None

    def send_request(self, request: bytes) -> None:
        """Send a frame, and remember what it asks for."""
        if request[0] >> 5 in _INITIATE:
            self._asked = bytes(request[:4])
        super().send_request(request)

    def on_response(self, can_id: int, data: bytes, timestamp: float) -> None:
        """Take a frame of the node."""
        command = data[0] >> 5 if len(data) == 8 else None
        if command is None or self._asked is None:
            return
        begins = command in (*_INITIATE.values(), _ABORT)
        fits = data[1:4] == self._asked[1:4] and command in (_INITIATE[self._asked[0] >> 5], _ABORT)
        if fits or not begins:
            super().on_response(can_id, data, timestamp)

    def read_response(self) -> bytes:
        """Answer of the node, as the library reads it, after frames were taken off the bus until there is one."""
        deadline = time.monotonic_ns() + round(SDO_TIMEOUT_S * 1e9)
        while self.responses.empty():
            if not self._pump.receive(deadline) and time.monotonic_ns() >= deadline:
                raise SdoCommunicationError("no answer to an SDO request")
        return super().read_response()
