"""One drive: what it is, what it is told in each cycle and what it answered."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from tauscope_drivers.backend import ControlMode
from tauscope_drivers.canopen import objects
from tauscope_drivers.canopen.bus import EMERGENCY_ID, HEARTBEAT_ID, NMT_OPERATIONAL_STATE, CanBus
from tauscope_drivers.canopen.configuration import NodeConfiguration
from tauscope_drivers.canopen.data_sheet.needs import require_identity
from tauscope_drivers.canopen.emergency import HEARTBEAT_LOST, decode_emergency, describe_error
from tauscope_drivers.canopen.glitch_filter import GlitchFilter
from tauscope_drivers.canopen.objects import DriveObject
from tauscope_drivers.canopen.process_data import (
    MOTION_PDO,
    SENT_IDS,
    STATE_PDO,
    TARGET_PDOS,
    PdoLayout,
    decode_pdo,
    encode_pdo,
)
from tauscope_drivers.canopen.sdo import NodeDictionary
from tauscope_drivers.canopen.state_machine import DriveState, Goal, decode_state, next_controlword
from tauscope_drivers.canopen.units import DriveUnits, drive_units
from tauscope_drivers.errors import DriverError, DriverErrorKind, Fault

MODES = {ControlMode.POSITION: objects.CYCLIC_POSITION, ControlMode.TORQUE: objects.CYCLIC_TORQUE}

_CIA_402 = 402


@dataclass(frozen=True)
class Measurement:
    """Of a joint, by its drive; NaN where it did not come.

    position : float
        [rad or m]
    velocity : float
        [rad/s or m/s]
    effort : float
        torque at the joint [Nm or N]
    """

    position: float
    velocity: float
    effort: float


@dataclass(eq=False)
class DriveNode:
    """A drive on the bus.

    joint : int
        number of its joint, from 1
    last_position : float
        of the joint when it last answered: the place to stay at, never a measurement [rad or m]
    """

    configuration: NodeConfiguration
    joint: int
    dictionary: NodeDictionary
    units: DriveUnits = field(default=DriveUnits(math.nan, 0, math.nan))
    values: dict[DriveObject, int] = field(default_factory=dict)
    error_code: int = 0
    acknowledged_code: int = 0
    measurement: Measurement = Measurement(math.nan, math.nan, math.nan)
    last_state: DriveState | None = None
    last_position: float = math.nan
    is_deaf: bool = False
    glitches: GlitchFilter = field(default_factory=GlitchFilter)

    @staticmethod
    def on_bus(bus: CanBus, configuration: NodeConfiguration, joint: int) -> "DriveNode":
        """A drive whose frames are listened to from now on.

        Parameters
        ----------
        joint : int
            number of its joint, from 1
        """
        node_id = configuration.node_id
        node = DriveNode(configuration, joint, bus.add_node(node_id))
        for identifier, layout in zip(SENT_IDS, (STATE_PDO, MOTION_PDO), strict=True):
            bus.subscribe(identifier + node_id, lambda _, data, layout=layout: node._take(layout, data))
        bus.subscribe(EMERGENCY_ID + node_id, lambda _, data: node._take_emergency(data))
        bus.subscribe(HEARTBEAT_ID + node_id, lambda _, data: node._take_heartbeat(data))
        return node

    @property
    def state(self) -> DriveState | None:
        """Power state as this cycle's statusword tells; None where none came."""
        word = self.values.get(objects.STATUSWORD)
        return None if word is None else decode_state(word)

    @property
    def has_answered(self) -> bool:
        """Whether both of its frames came in this cycle."""
        return objects.STATUSWORD in self.values and objects.VELOCITY_ACTUAL in self.values

    def identify(self) -> frozenset[ControlMode]:
        """Make sure that it is the drive that is meant, learn its units, and return the modes that it has.

        Raises
        ------
        DriverError
            ``cannot-connect``: it does not answer or is no CiA 402 drive; ``refused``: its rated torque is not usable,
            or it is not the drive of its EDS or DCF file
        """
        kind = self.dictionary.read(objects.DEVICE_TYPE) & 0xFFFF
        if kind != _CIA_402:
            raise DriverError(
                DriverErrorKind.CANNOT_CONNECT,
                f"{self.place}: its device profile is {kind}, not 402 (drives); check drive.node_id",
            )
        if self.configuration.device_file is not None:
            require_identity(self.configuration.device_file, self.dictionary, self.place)
        self.units = self._learn_units()
        supported = self.dictionary.read(objects.SUPPORTED_MODES)
        return frozenset(mode for mode, number in MODES.items() if supported >> (number - 1) & 1)

    def remember(self, time_ns: int) -> None:
        """Keep state and place of this cycle for cycles without an answer; a frame that cannot be true is none."""
        self.measurement = measured = self._measured()
        if not self.glitches.believes_place(measured.position, time_ns):
            self._forget(STATE_PDO)
        elif not math.isnan(measured.position):
            self.last_position = measured.position
        if not self.glitches.believes_speed(measured.velocity):
            self._forget(MOTION_PDO)
        self.last_state = self.state or self.last_state

    def read_now(self) -> None:
        """Fill `values` by SDO: for an arm that is not in its cycle."""
        self.values = {entry: self.dictionary.read(entry) for entry in (*STATE_PDO.objects, *MOTION_PDO.objects)}
        if self.values[objects.ERROR_CODE]:
            self.error_code = self.values[objects.ERROR_CODE]

    def target(self, mode: ControlMode, controlword: int, position: float, torque: float) -> bytes:
        """Payload of its target frame.

        Parameters
        ----------
        position : float
            of the joint, finite [rad or m]
        torque : float
            of the joint, finite [Nm or N]

        Raises
        ------
        DriverError
            ``refused``: the target is beyond what the drive can be told
        """
        layout = TARGET_PDOS[mode]
        quantity = self.units.counts(position) if mode is ControlMode.POSITION else self.units.permille(torque)
        try:
            return encode_pdo(layout, {objects.CONTROLWORD: controlword, layout.objects[1]: quantity})
        except OverflowError as error:
            raise DriverError(DriverErrorKind.REFUSED, f"{self.place}: {error}; check counts_per_turn") from error

    def controlword(self, goal: Goal) -> int:
        """Next controlword towards a goal; a lost answer changes nothing, or it would drop an arm under power."""
        return next_controlword(self.last_state, goal)

    def faults(self) -> tuple[Fault, ...]:
        """What it reports: a code in its cycle or by emergency, and the state of fault without one."""
        code = self.values.get(objects.ERROR_CODE, 0) or self.error_code
        is_in_fault = self.state in (DriveState.FAULT, DriveState.FAULT_REACTION)
        if code == self.acknowledged_code and not is_in_fault:
            return ()
        fault = describe_error(code, self.joint)
        if fault is None and is_in_fault:
            fault = Fault("drive", self.joint, "in fault, without an error code", "see the drive's own display")
        return () if fault is None else (fault,)

    @property
    def place(self) -> str:
        """Joint and node, for messages."""
        return f"joint {self.joint} (node {self.configuration.node_id})"

    def _measured(self) -> Measurement:
        """What this cycle's values say of the joint."""

        def converted(entry: DriveObject, to_joint: Callable[[int], float]) -> float:
            return to_joint(self.values[entry]) if entry in self.values else math.nan

        return Measurement(
            position=converted(objects.POSITION_ACTUAL, self.units.position),
            velocity=converted(objects.VELOCITY_ACTUAL, self.units.velocity),
            effort=converted(objects.TORQUE_ACTUAL, self.units.torque),
        )

    def _learn_units(self) -> DriveUnits:
        configuration = self.configuration
        rated = configuration.rated_torque_nm or self.dictionary.read_surely(objects.RATED_TORQUE) / 1000.0
        if rated <= 0.0:
            raise DriverError(
                DriverErrorKind.REFUSED,
                f"{self.place}: its rated torque (0x6076) reads 0; give drive.rated_torque_nm",
            )
        return drive_units(configuration, rated)

    def _take(self, layout: PdoLayout, data: bytes) -> None:
        values = decode_pdo(layout, data)
        if values is not None:
            self.values.update(values)
            self.is_deaf = False

    def _forget(self, layout: PdoLayout) -> None:
        self.values = {entry: value for entry, value in self.values.items() if entry not in layout.objects}
        self.measurement = self._measured()

    def _take_heartbeat(self, data: bytes) -> None:
        self.is_deaf = len(data) == 1 and data[0] & 0x7F != NMT_OPERATIONAL_STATE

    def _take_emergency(self, data: bytes) -> None:
        code = decode_emergency(data)
        if code is not None and code & 0xFF00:
            self.error_code, self.acknowledged_code = code, 0
            self.is_deaf |= code == HEARTBEAT_LOST
