"""The frames that a run would send, without a port."""

from collections.abc import Iterator, Mapping, Sequence

from tauscope_drivers.backend import ControlMode, StopPolicy
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.errors import DriverError
from tauscope_drivers.feetech import packets
from tauscope_drivers.feetech.bus import encode_registers
from tauscope_drivers.feetech.commissioning import Reading, plan_task
from tauscope_drivers.feetech.configuration import read_configuration
from tauscope_drivers.feetech.enabling import goal_writes, taking_writes
from tauscope_drivers.feetech.registers import COUNTS_PER_TURN, FEEDBACK, IDENTITY, PERMILLE, SETTINGS, TARGETS, Block
from tauscope_drivers.feetech.servo import JointServo
from tauscope_drivers.goal_pace import GoalPace
from tauscope_drivers.inspection import FrameRequest, PlannedFrame
from tauscope_drivers.limits import require_sensible

_frame = PlannedFrame.on_serial_bus

# a servo as delivered, at 7.4 V
_DELIVERED = Reading(
    {"Min Position Limit": 0, "Max Position Limit": COUNTS_PER_TURN - 1, "Max Torque Limit": PERMILLE},
    {"Present Voltage": 74},
)


def plan_frames(joints: Sequence[DriveJoint], request: FrameRequest) -> Iterator[PlannedFrame]:
    """Frames of a connection, some cycles and a stop, for servos as delivered. Raises DriverError ``refused``."""
    if request.mode is not ControlMode.POSITION:
        raise DriverError.refusal(f"these servos cannot do mode {request.mode}; choose {ControlMode.POSITION}")
    servos = [JointServo(number, servo) for number, servo in enumerate(read_configuration(joints).servos, 1)]
    require_sensible(request.limits, request.targets[0], [servo.label for servo in servos])
    tasks = [plan_task(servo, _DELIVERED, request.limits, joint) for joint, servo in enumerate(servos)]
    for servo in servos:
        yield _frame("connect", f"{servo.label}: are you there?", packets.encode_ping(servo.servo))
        yield _read(servo, "connect", IDENTITY, "model and firmware?")
        yield _read(servo, "connect", SETTINGS, "settings in EEPROM?")
    for servo, task, place in zip(servos, tasks, request.targets[0], strict=True):
        for write in taking_writes(task, servo.counts(float(place)), None):
            told = ", ".join(f"{name} := {value}" for name, value in write.items())
            frame = packets.encode_write(servo.servo, *encode_registers(write))
            yield _frame("enable", f"{servo.label}: {told}", frame)
    held = [servo.counts(float(place)) for servo, place in zip(servos, request.targets[0], strict=True)]
    pace, cycle_s = None, request.cycle_s
    if cycle_s is not None:
        pace = GoalPace(servos, held, [task.speed for task in tasks], cycle_s, 0)
    for cycle, targets in enumerate(request.targets):
        goals = [task.bound(servo.counts(place)) for task, servo, place in zip(tasks, servos, targets, strict=True)]
        writes = goal_writes(goals, tasks, pace, round(cycle * (cycle_s or 0.0) * 1e9))
        yield from _cycle(servos, writes, servos[cycle % len(servos)])
    for servo in servos:
        yield _read(servo, "stop", TARGETS, f"holds its last goal ({StopPolicy.HOLD}): torque and limits?")


def _cycle(
    servos: Sequence[JointServo], writes: Sequence[Mapping[str, int]], turn: JointServo
) -> Iterator[PlannedFrame]:
    encoded = {servo.servo: encode_registers(values) for servo, values in zip(servos, writes, strict=True)}
    address = next(iter(encoded.values()))[0]
    told = ", ".join(
        f"{servo.servo} := {values['Goal Position']} at {values['Goal Speed']}"
        for servo, values in zip(servos, writes, strict=True)
    )
    data = {servo: data for servo, (_, data) in encoded.items()}
    yield _frame("cycle", f"Goal Position and Goal Speed: servo {told}", packets.encode_sync_write(data, address))
    identifiers = [servo.servo for servo in servos]
    asked = ", ".join(map(str, identifiers))
    frame = packets.encode_sync_read(identifiers, FEEDBACK.address, FEEDBACK.length)
    yield _frame("cycle", f"servos {asked}: position, speed, load, voltage, temperature?", frame)
    yield _read(turn, "cycle", TARGETS, "torque and limits?")


def _read(servo: JointServo, phase: str, block: Block, meaning: str) -> PlannedFrame:
    frame = packets.encode_read(servo.servo, block.address, block.length)
    return _frame(phase, f"{servo.label}: {meaning}", frame)
