"""Everything that commissioning of a drive needs, looked at without a write."""

from collections.abc import Callable

import numpy as np

from tauscope_drivers.backend import ControlMode
from tauscope_drivers.canopen import objects
from tauscope_drivers.canopen.commissioning import find_missing
from tauscope_drivers.canopen.node import DriveNode
from tauscope_drivers.canopen.pdo_mapping import read_mapping
from tauscope_drivers.canopen.pdo_plan import decode_mapping
from tauscope_drivers.canopen.process_data import received_parameters, sent_parameters
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.errors import DriverError
from tauscope_drivers.inspection import Finding, Severity, failure
from tauscope_drivers.limits import require_sensible, stated_limits


def rehearse(node: DriveNode, joint: DriveJoint) -> list[Finding]:
    """What would keep a run with the limits of the robot file from starting. `node`: identified and read."""
    checks: tuple[Callable[[], list[Finding]], ...] = (
        lambda: _examine_settings(node),
        lambda: _examine_place(node, joint),
        lambda: _examine_torque(node, joint),
        lambda: _examine_mapping(node),
        lambda: _examine_abort(node),
    )
    findings: list[Finding] = []
    for check in checks:
        try:
            findings += check()
        except DriverError as error:
            findings.append(failure(node.place, str(error), f"node {node.configuration.node_id}"))
    return findings


def _examine_settings(node: DriveNode) -> list[Finding]:
    """Values of its DCF file: it has their objects, and no power while one is missing."""
    if node.configuration.device_file is not None:
        find_missing(node, node.configuration.device_file)
    return []


def _examine_place(node: DriveNode, joint: DriveJoint) -> list[Finding]:
    """The joint stands within its range."""
    place = node.units.position(node.dictionary.read(objects.POSITION_ACTUAL))
    require_sensible(stated_limits([joint]), np.array([place]), [node.place])
    return []


def _examine_torque(node: DriveNode, joint: DriveJoint) -> list[Finding]:
    """The drive's limit and the joint's leave torque."""
    limits = stated_limits([joint])
    if not node.has(objects.LARGEST_TORQUE):
        return []
    cap = node.dictionary.read(objects.LARGEST_TORQUE)
    if np.isfinite(limits.torque[0]):
        cap = min(cap, node.units.torque_cap(float(limits.torque[0])))
    if cap > 0:
        return []
    remedy = "raise it with the maker's tool, and check limits.torque and rated_torque_nm"
    return [Finding(Severity.FAILURE, node.place, f"{objects.LARGEST_TORQUE} leaves no torque", remedy)]


def _examine_mapping(node: DriveNode) -> list[Finding]:
    """Whether its PDOs hold all that is needed, or can be mapped so."""
    if ControlMode.POSITION not in node.mode_numbers:
        return []
    plan = node.plan_for(ControlMode.POSITION)
    if plan.missing:
        detail = f"{plan.missing[0]} is in none of its PDOs, and their mapping is fixed"
        return [Finding(Severity.FAILURE, node.place, detail, "map it with the maker's tool, or use another drive")]
    if node.configuration.device_file is not None:
        return _compare_fixed(node)
    detail = "has no EDS or DCF file: whether its objects and PDOs can be written shows only when a run writes them"
    return [Finding(Severity.WARNING, node.place, detail, "name its file as drive.eds")]


def _compare_fixed(node: DriveNode) -> list[Finding]:
    """PDOs of fixed mapping hold what its file states."""
    plan = node.plan_for(ControlMode.POSITION)
    uses = [*((pdo, received_parameters) for pdo in plan.received), *((pdo, sent_parameters) for pdo in plan.sent)]
    for pdo, parameters in uses:
        if pdo.is_fixed and decode_mapping(read_mapping(node, parameters(pdo.number, 0))) != pdo.layout.objects:
            detail = f"its PDO {pdo.number + 1} is not mapped as its EDS or DCF file states"
            return [Finding(Severity.FAILURE, node.place, detail, "give the file of this drive")]
    return []


def _examine_abort(node: DriveNode) -> list[Finding]:
    """A drive does something when its master is silent."""
    if node.has(objects.ABORT_CONNECTION) or node.dictionary.read_optional(objects.ABORT_CONNECTION) != 0:
        return []
    detail = f"{objects.ABORT_CONNECTION} is 0 and read-only: it goes on when the host is gone"
    return [Finding(Severity.FAILURE, node.place, detail, "set it to 1, 2 or 3 with the maker's tool")]
