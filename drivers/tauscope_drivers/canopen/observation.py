"""An arm's state from what its drives answered."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tauscope_drivers.canopen.emergency import WATCHDOG_CODE
from tauscope_drivers.canopen.node import DriveNode
from tauscope_drivers.canopen.state_machine import DriveState
from tauscope_drivers.errors import Fault
from tauscope_drivers.state import ArmState

_UNDER_POWER = (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE)


def arm_state(nodes: Sequence[DriveNode], time_ns: int, caught: Fault | None) -> ArmState:
    """What the nodes answered, in joint units; NaN where they did not."""
    measured = [node.measurement for node in nodes]
    return ArmState(
        time_ns=time_ns,
        position=np.array([one.position for one in measured]),
        velocity=np.array([one.velocity for one in measured]),
        effort=np.array([one.effort for one in measured]),
        temperature=np.full(len(nodes), math.nan),
        # of a node that did not answer, as it last told: whether it is missed is what NaN says
        enabled=np.array([node.last_state in _UNDER_POWER for node in nodes]),
        faults=arm_faults(nodes, caught),
    )


def arm_faults(nodes: Sequence[DriveNode], caught: Fault | None) -> tuple[Fault, ...]:
    """What drives report and what the driver itself has caught; a host that fell silent is one fault of the arm."""
    reported = [fault for node in nodes for fault in node.faults()]
    silence = [replace(fault, joint=None) for fault in reported if fault.code == WATCHDOG_CODE]
    own = [] if caught is None else [caught]
    return (*own, *silence[:1], *(fault for fault in reported if fault.code != WATCHDOG_CODE))


def blind_state(time_ns: int, joint_count: int) -> ArmState:
    """The state of an arm that nobody is connected to."""
    unknown = np.full(joint_count, math.nan)
    return ArmState(time_ns, unknown, unknown, unknown, unknown, np.zeros(joint_count, dtype=np.bool_))


def listed(faults: Sequence[Fault]) -> str:
    """Faults in one line, for messages."""
    return "; ".join(str(fault) for fault in faults)
