"""One drive: what it is, what it is told in each cycle and what it answered."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

from tauscope_drivers.backend import ControlMode
from tauscope_drivers.canopen import objects, process_data
from tauscope_drivers.canopen.bus import EMERGENCY_ID, HEARTBEAT_ID, MASTER_NODE, NMT_OPERATIONAL_STATE, CanBus
from tauscope_drivers.canopen.configuration import NodeConfiguration
from tauscope_drivers.canopen.data_sheet.needs import needs_guarding, pdo_slots, present_objects, require_identity
from tauscope_drivers.canopen.emergency import HEARTBEAT_LOST, decode_emergency, describe_error
from tauscope_drivers.canopen.objects import SUBSTITUTES, TARGETS, DriveObject
from tauscope_drivers.canopen.sdo import NodeDictionary
from tauscope_drivers.canopen.state_machine import ENABLE_OPERATION, DriveState, Goal, decode_state, next_controlword
from tauscope_drivers.canopen.units import DriveUnits, drive_units, read_rated_torque
from tauscope_drivers.errors import DriverError, Fault

BEATS = 10  # of the host within a drive's watchdog time: one lost frame stops nothing
PRODUCER_HEARTBEAT_MS = 100

FASTEST = 3.0  # a joint is believed to be so many times as fast as its limit, no faster
SLACK_S = 0.002  # how much later than the host thinks a drive may have sampled [s]


class GlitchFilter:
    """Doubts a reading that is farther from the one before than its joint can have gone, or faster than it can go.

    One reading is doubted at a time: a joint that truly runs away, or whose encoder jumped, gives the next one too.

    `limit`: speed limit of the joint; infinite as long as nothing is doubted [rad/s or m/s].
    """

    def __init__(self) -> None:
        self.limit = math.inf
        self._believed: tuple[float, int] | None = None
        self._doubts_place = self._doubts_speed = False

    def believes_place(self, position: float, time_ns: int) -> bool:
        """Whether a position may be true; NaN is no lie. Instants never run backwards."""
        if math.isnan(position):
            return True
        before, before_ns = self._believed or (position, time_ns)
        reach = FASTEST * self.limit * ((time_ns - before_ns) * 1e-9 + SLACK_S)
        self._doubts_place = not self._doubts_place and abs(position - before) > reach
        if not self._doubts_place:
            self._believed = position, time_ns
        return not self._doubts_place

    def believes_speed(self, velocity: float) -> bool:
        """Whether a velocity may be true; NaN is no lie."""
        self._doubts_speed = not self._doubts_speed and abs(velocity) > FASTEST * self.limit
        return not self._doubts_speed


_CIA_402 = 402
_INTERPOLATE = 0x10  # bit of the controlword that starts interpolation, in the mode of that name


class Measurement(NamedTuple):
    """Of a joint, by its drive; NaN where it did not come."""

    position: float  # [rad or m]
    velocity: float  # [rad/s or m/s]
    effort: float  # torque at the joint [Nm or N]


@dataclass(eq=False)
class DriveNode:
    """A drive. `last_position`: when it last answered, never a measurement [rad or m]; `mode_numbers`: its modes'."""

    configuration: NodeConfiguration
    joint: int  # number of its joint, from 1
    dictionary: NodeDictionary
    bus: CanBus = field(repr=False, kw_only=True)
    units: DriveUnits = field(default=DriveUnits(math.nan, 0, math.nan))
    values: dict[DriveObject, int] = field(default_factory=dict)
    error_code: int = 0
    acknowledged_code: int = 0
    measurement: Measurement = field(default=Measurement(math.nan, math.nan, math.nan))
    last_state: DriveState | None = None
    last_position: float = math.nan
    last_velocity: float = 0.0  # of the joint when it last told one [rad/s or m/s]
    is_deaf: bool = False
    glitches: GlitchFilter = field(default_factory=GlitchFilter)
    present: frozenset[DriveObject] = frozenset(SUBSTITUTES)  # optional objects that it has
    mode_numbers: dict[ControlMode, int] = field(default_factory=dict)
    slots: process_data.PdoSlots = field(default_factory=process_data.PdoSlots)
    plan: process_data.PdoPlan = field(default=process_data.PdoPlan((), ()))
    held: dict[DriveObject, int] = field(default_factory=dict)  # values of other objects in its RPDOs of fixed mapping
    stays_stopped: bool = True  # whether it keeps its power after a quick stop
    remarks: tuple[str, ...] = ()
    is_guarded: bool = False  # by remote frames, for it watches no heartbeat

    @staticmethod
    def on_bus(bus: CanBus, configuration: NodeConfiguration, joint: int) -> "DriveNode":
        """A drive whose frames are listened to from now on. `joint`: number of its joint, from 1."""
        node_id = configuration.node_id
        node = DriveNode(configuration, joint, bus.add_node(node_id), bus=bus)
        node.use_plan(node.plan_for(ControlMode.POSITION))
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
        """Whether all of its frames came in this cycle."""
        return all(pdo.layout.objects[0] in self.values for pdo in self.plan.sent)

    def has(self, entry: DriveObject) -> bool:
        """Whether it has an optional object, which can be written where the driver writes it."""
        return entry in self.present

    def plan_for(self, mode: ControlMode) -> process_data.PdoPlan:
        """Its PDOs for a mode."""
        number = self.mode_numbers.get(mode, next(iter(TARGETS[mode])))
        return process_data.plan_pdos(
            self.slots, TARGETS[mode][number], [one for one in process_data.MEASURED_WHERE_THERE if self.has(one)]
        )

    def use_plan(self, plan: process_data.PdoPlan) -> None:
        """Listen to the frames of a plan from now on."""
        self.plan = plan
        for pdo in plan.sent:
            identifier = pdo.identifier(self.configuration.node_id)
            self.bus.subscribe(identifier, lambda _, data, layout=pdo.layout: self._take(layout, data))

    def identify(self) -> frozenset[ControlMode]:
        """Make sure that it is the drive that is meant, learn its units, and return the modes that it has.

        Raises DriverError: ``cannot-connect``: it does not answer or is no CiA 402 drive; ``refused``: its rated torque
        is not usable, it does not watch its master, or it is not the drive of its EDS or DCF file.
        """
        kind = self.dictionary.read(objects.DEVICE_TYPE) & 0xFFFF
        if kind != _CIA_402:
            raise DriverError.no_connection(
                f"{self.place}: its device profile is {kind}, not 402 (drives); check drive.node_id"
            )
        file = self.configuration.device_file
        if file is not None:
            require_identity(file, self.dictionary, self.place)
            self.slots = pdo_slots(file)
        self._find_watchdog()
        found = (entry for entry in SUBSTITUTES if self.dictionary.read_optional(entry) is not None)
        self.present = frozenset(found) & (frozenset(SUBSTITUTES) if file is None else present_objects(file))
        self.remarks = (*([objects.GUARDED] if self.is_guarded else []), *objects.describe_absent(self.present))
        self.stays_stopped = self.dictionary.read_optional(objects.QUICK_STOP_OPTION) in objects.STAYING_OPTIONS
        self.units = self._learn_units()
        self.mode_numbers = objects.select_modes(self.dictionary.read(objects.SUPPORTED_MODES))
        if not self.has(objects.VELOCITY_ACTUAL):
            self.mode_numbers.pop(ControlMode.TORQUE, None)
        if self.mode_numbers.get(ControlMode.POSITION) == objects.INTERPOLATED_POSITION:
            self.remarks += ("has no cyclic synchronous position mode (0x6502): interpolated position is used",)
        return frozenset(self.mode_numbers)

    def remember(self, time_ns: int) -> None:
        """Keep state and place of this cycle for cycles without an answer; a frame that cannot be true is none."""
        self.measurement = measured = self._decode_measurements()
        if not self.glitches.believes_place(measured.position, time_ns):
            self._forget(objects.POSITION_ACTUAL)
        elif not math.isnan(measured.position):
            self.last_position = measured.position
        if not self.glitches.believes_speed(measured.velocity):
            self._forget(objects.VELOCITY_ACTUAL)
        elif not math.isnan(measured.velocity):
            self.last_velocity = measured.velocity
        self.last_state = self.state or self.last_state

    def read_now(self) -> None:
        """Fill `values` by SDO: for an arm that is not in its cycle."""
        entries = (*process_data.MEASURED, *(entry for entry in process_data.MEASURED_WHERE_THERE if self.has(entry)))
        self.values = {entry: self.dictionary.read(entry) for entry in entries}
        self.error_code = self.values.get(objects.ERROR_CODE) or self.error_code

    def targets(self, mode: ControlMode, controlword: int, position: float, torque: float) -> list[tuple[int, bytes]]:
        """Its target frames. Raises DriverError ``refused`` beyond what it takes. [rad or m], [Nm or N]; finite."""
        target = TARGETS[mode][self.mode_numbers[mode]]
        quantity = self.units.counts(position) if mode is ControlMode.POSITION else self.units.permille(torque)
        is_enabled = controlword == ENABLE_OPERATION and self.last_state is DriveState.OPERATION_ENABLED
        if target == objects.INTERPOLATION_DATA and is_enabled:
            controlword |= _INTERPOLATE
        values = {**self.held, objects.CONTROLWORD: controlword, target: quantity}
        try:
            node_id, received = self.configuration.node_id, self.plan.received
            return [(pdo.identifier(node_id), process_data.encode_pdo(pdo.layout, values)) for pdo in received]
        except OverflowError as error:
            raise DriverError.refusal(f"{self.place}: {error}; check counts_per_turn") from error

    def controlword(self, goal: Goal) -> int:
        """Next controlword towards a goal; a lost answer changes nothing, or it would drop an arm under power.

        A drive that has no power after a quick stop is stopped by its targets, and stays enabled.
        """
        if self.holds_by_targets and goal is Goal.QUICK_STOP:
            goal = Goal.OPERATION_ENABLED
        return next_controlword(self.last_state, goal)

    @property
    def holds_by_targets(self) -> bool:
        """Whether a stop that holds keeps it enabled: it is, and would let go by a quick stop."""
        return not self.stays_stopped and self.last_state is DriveState.OPERATION_ENABLED

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

    def _decode_measurements(self) -> Measurement:
        def convert(entry: DriveObject, to_joint: Callable[[int], float]) -> float:
            return to_joint(self.values[entry]) if entry in self.values else math.nan

        return Measurement(
            position=convert(objects.POSITION_ACTUAL, self.units.position),
            velocity=convert(objects.VELOCITY_ACTUAL, self.units.velocity),
            effort=convert(objects.TORQUE_ACTUAL, self.units.torque),
        )

    def _learn_units(self) -> DriveUnits:
        configuration = self.configuration
        if configuration.rated_torque_nm is not None:
            return drive_units(configuration, configuration.rated_torque_nm)
        flaw = "is not there"
        if self.dictionary.read_optional(objects.RATED_TORQUE) is not None:
            value = self.dictionary.read_surely(objects.RATED_TORQUE)
            current = self.dictionary.read_optional(objects.RATED_CURRENT)
            try:
                rated = read_rated_torque(value, configuration.gear_ratio, configuration.torque_limit, current)
            except ValueError as error:
                flaw = str(error)
            else:
                self.remarks += (f"its rated torque (0x6076) {rated.remark}",) if rated.remark else ()
                return drive_units(configuration, rated.nm)
        raise DriverError.refusal(f"{self.place}: its rated torque (0x6076) {flaw}; give drive.rated_torque_nm")

    def _find_watchdog(self) -> None:
        """Find out how it notices that the host is gone, and refuse a drive that would not."""
        file, read = self.configuration.device_file, self.dictionary.read_optional
        self.is_guarded = read(objects.CONSUMER_HEARTBEAT) is None or (file is not None and needs_guarding(file))
        if self.is_guarded and None in map(read, objects.GUARDING):
            raise DriverError.refusal(
                f"{self.place}: has neither {objects.CONSUMER_HEARTBEAT} nor node guarding (0x100C, 0x100D): it would "
                "not notice that the host is gone; use a drive that watches its host"
            )

    def arm_watchdog(self, watchdog_s: float) -> None:
        """Let it stop where the host is silent for longer: by heartbeat, or by node guarding where it watches none.

        Node guarding (CiA 301): the host asks for its state by remote frames. One that is not asked within its life
        time, guard time (0x100C) × factor (0x100D), stops as one that misses a heartbeat. Raises DriverError
        ``refused`` where it does not take a value, or answers no remote frame.
        """
        write = self.dictionary.write
        if not self.is_guarded:
            write(objects.CONSUMER_HEARTBEAT, MASTER_NODE << 16 | round(watchdog_s * 1e3))
        if self.has(objects.PRODUCER_HEARTBEAT):
            # a node that produces heartbeats is not guarded
            write(objects.PRODUCER_HEARTBEAT, 0 if self.is_guarded else PRODUCER_HEARTBEAT_MS)
        if self.is_guarded:
            write(objects.LIFE_TIME_FACTOR, BEATS)
            write(objects.GUARD_TIME, int(watchdog_s * 1e3 / BEATS))
            self.require_guarding()
            self.bus.guarded.add(self.configuration.node_id)

    def require_guarding(self) -> None:
        """Ask it by a remote frame: guarding counts from the first. Raises DriverError ``refused``: no answer."""
        if not self.bus.ask_guard(self.configuration.node_id):
            raise DriverError.refusal(
                f"{self.place}: answers no remote frame, and would not notice that the host is gone; "
                "use an adapter that sends remote frames, or a drive with a heartbeat consumer (0x1016)"
            )

    def disarm_watchdog(self) -> None:
        """Let it be without its host. Raises DriverError where it does not answer, or does not take the value."""
        for entry in objects.GUARDING if self.is_guarded else (objects.CONSUMER_HEARTBEAT,):
            self.dictionary.write(entry, 0)

    def _take(self, layout: process_data.PdoLayout, data: bytes) -> None:
        values = process_data.decode_pdo(layout, data)
        if values is not None:
            self.values.update(values)
            self.is_deaf = False

    def _forget(self, doubted: DriveObject) -> None:
        """Drop a whole frame by one of its values."""
        gone = {entry for pdo in self.plan.sent if doubted in pdo.layout.objects for entry in pdo.layout.objects}
        self.values = {entry: value for entry, value in self.values.items() if entry not in gone}
        self.measurement = self._decode_measurements()

    def _take_heartbeat(self, data: bytes) -> None:
        self.is_deaf = len(data) == 1 and data[0] & 0x7F != NMT_OPERATIONAL_STATE

    def _take_emergency(self, data: bytes) -> None:
        code = decode_emergency(data)
        if code is not None and code & 0xFF00:
            self.error_code, self.acknowledged_code = code, 0
            self.is_deaf |= code == HEARTBEAT_LOST
