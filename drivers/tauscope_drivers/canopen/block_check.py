"""Looks at ``drive`` blocks and the EDS or DCF files that they name, without a bus."""

from collections.abc import Sequence

from tauscope_drivers.canopen import objects
from tauscope_drivers.canopen.configuration import NodeConfiguration, read_configuration, read_node
from tauscope_drivers.canopen.data_sheet.needs import present_objects, states_rated_torque
from tauscope_drivers.canopen.objects import describe_absent
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.errors import DriverError
from tauscope_drivers.inspection import Finding, Severity, failure


def check_blocks(joints: Sequence[DriveJoint]) -> list[Finding]:
    """Flaws of every joint at once; of usable drives, the absent objects and their substitutes."""
    findings: list[Finding] = []
    without: list[str] = []
    for joint in joints:
        place = f"joint {joint.name}"
        try:
            node = read_node(joint)
        except DriverError as error:
            findings.append(failure(place, str(error)))
            continue
        findings += _describe(place, node)
        without += [joint.name] if node.device_file is None else []
    if without:
        remedy = "name it as drive.eds: then its objects and mappings are known before a run"
        findings.append(Finding(Severity.WARNING, f"joint {', '.join(without)}", "no EDS or DCF file", remedy))
    if any(finding.severity is Severity.FAILURE for finding in findings):
        return findings
    try:
        read_configuration(joints)
    except DriverError as error:
        findings.append(failure("canopen", str(error)))
    return findings


def _describe(place: str, node: NodeConfiguration) -> list[Finding]:
    """What a drive's file states."""
    file = node.device_file
    if file is None:
        return []
    absent = describe_absent(present_objects(file))
    doubts: list[Finding] = []
    if node.rated_torque_nm is None and not states_rated_torque(file):
        detail = f"{file.name} has no {objects.RATED_TORQUE}: torque in ‰ of it means nothing, and a run is refused"
        doubts.append(Finding(Severity.WARNING, place, detail, "state drive.rated_torque_nm"))
    usable = Finding(Severity.GOOD, place, f"{file.name} describes all that the driver needs")
    return [usable, *doubts, *(Finding(Severity.GOOD, place, f"{file.name} {line}") for line in absent)]
