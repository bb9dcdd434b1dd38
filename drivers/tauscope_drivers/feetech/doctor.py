"""Looks at the servos of a port, moves nothing, writes nothing, and says what to do about what it finds."""

from collections.abc import Sequence
from functools import partial

from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.errors import DriverError
from tauscope_drivers.feetech.bus import FeetechBus, count_traffic
from tauscope_drivers.feetech.commissioning import find_doubts, read_servo, rehearse
from tauscope_drivers.feetech.configuration import ServoConfiguration, read_configuration
from tauscope_drivers.feetech.registers import FEEDBACK, IDENTITY, describe_device, describe_firmware
from tauscope_drivers.feetech.servo import JointServo
from tauscope_drivers.feetech.session import make_session, reach
from tauscope_drivers.inspection import Finding, failure
from tauscope_drivers.limits import stated_limits
from tauscope_drivers.serial_servos.doctor import examine_bus, measure_loop_rate, scan_bauds

# rates that servos can be set to, the factory's first [bit/s]
USUAL_BAUDS = (1_000_000, 500_000, 250_000, 128_000, 115_200, 57_600, 38_400)


def _examine_servos(
    bus: FeetechBus, servos: Sequence[ServoConfiguration], joints: Sequence[DriveJoint]
) -> list[Finding]:
    findings: list[Finding] = []
    found: list[tuple[JointServo, dict[str, int]]] = []
    for number, wanted in enumerate(servos, 1):
        try:
            found.append(reach(bus, number, wanted))
        except DriverError as error:
            findings.append(failure(JointServo(number, wanted).label, str(error)))
    if len(found) < len(servos):
        return findings
    session = make_session(bus, found)
    for joint, described in enumerate(joints):
        servo, limits = session.servos[joint], stated_limits([described])
        reading, targets = read_servo(session, joint), session.read_targets(joint)
        findings += find_doubts(servo, reading, limits, targets)
        findings += rehearse(servo, reading, limits)
    traffic, identifiers = count_traffic(len(servos)), session.identifiers
    rate = measure_loop_rate(bus, lambda: bus.sync_read(identifiers, FEEDBACK), traffic, bus.return_delay_s)
    return [*findings, rate]


def _list_servos(bus: FeetechBus) -> list[tuple[int, str, str]]:
    found = [(servo, bus.read(servo, IDENTITY)[1]) for servo in bus.ping_all()]
    return [(servo, describe_device(servo, identity), describe_firmware(identity)) for servo, identity in found]


examine = partial(examine_bus, read_configuration, FeetechBus, _examine_servos)
scan_bus = partial(scan_bauds, USUAL_BAUDS, FeetechBus, _list_servos)
