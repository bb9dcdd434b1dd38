"""The chain between two links of a URDF or MJCF, and notes on how it was chosen."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tauscope.errors import one_line
from tauscope.result_warning import ResultWarning
from tauscope.robot.actuator import Actuator
from tauscope.robot.messages import Finding, shown
from tauscope.robot.robot import Coupling, FrictionCoefficients, JointLimits, JointType, LinkInertia, Repair, Segment

MOST_NAMES = 4  # names that a note lists


@dataclass(frozen=True, eq=False)
class Chain:
    """Joints, segments and bodies from the base to the tip."""

    base: str
    tip: str
    joint_names: tuple[str, ...]
    joint_types: tuple[JointType, ...]
    segment_names: tuple[str, ...]  # the file's joint of each segment
    segments: tuple[Segment, ...]  # one a joint, and one for each joint that follows another
    limits: tuple[JointLimits, ...]
    # one a segment, about the link frame; zero without inertia, None where no link has any
    links: tuple[LinkInertia, ...] | None
    friction: tuple[FrictionCoefficients, ...] | None  # one a joint; None where no joint states it
    rotor_inertia: tuple[float, ...] | None  # one a joint [kg m² or kg]; None where no joint states it
    link_names: tuple[tuple[str, ...], ...]  # links of the file that make up each link
    branches: tuple[LinkInertia, ...]  # the part of each link that an export leaves where the file has it
    actuators: tuple[Actuator | None, ...]  # one a joint; None where the file has none
    findings: tuple[Finding, ...]
    repairs: tuple[Repair, ...]
    notes: tuple[ResultWarning, ...] = ()
    gravity: NDArray[np.float64] | None = None  # (3,), in the base frame [m/s²]; None where the file states none


@dataclass(frozen=True)
class Master:
    """The joint that another one follows in the end: the other is at multiplier · its position + offset."""

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0


class ChainMotion:
    """Which joints of a chain move, and how."""

    def __init__(self, masters: Mapping[str, Master | None]) -> None:
        """Take the joints of a chain that are not held, base first, and what each follows."""
        every = {name: master or Master(name) for name, master in masters.items()}
        own = {name for name, master in masters.items() if master is None}
        # Base first, those that are their own masters, and those that follow one of them.
        self.moving = {name: master for name, master in every.items() if master.joint in own}
        self.independent = tuple(dict.fromkeys(master.joint for master in self.moving.values()))
        self.couplings: dict[str, Coupling | None] = {}  # None of one that is the next one itself
        met: set[str] = set()
        for name, master in self.moving.items():
            is_next = master.joint not in met and (master.multiplier, master.offset) == (1.0, 0.0)
            place = self.independent.index(master.joint)
            self.couplings[name] = None if is_next else Coupling(place, master.multiplier, master.offset)
            met.add(master.joint)

    def friction(self, stated: Mapping[str, tuple[float, float]]) -> tuple[FrictionCoefficients, ...]:
        """Friction of independent joints: one that follows adds |m| times its dry friction, m² times its damping."""
        total = {name: np.zeros(2) for name in self.independent}
        for name, (dry, damping) in stated.items():
            master = self.moving[name]
            total[master.joint] += abs(master.multiplier) * dry, master.multiplier**2 * damping
        return tuple(FrictionCoefficients(stiction=float(d), viscous=float(v)) for d, v in total.values())


def default_ends_note(label: str, kind: str, base: str, tip: str, joints: Sequence[str]) -> ResultWarning:
    """Where the chain runs in a file for which the user names no base or no tip."""
    listed = ", ".join(map(shown, joints))
    text = f"{label}: the chain runs from {shown(base)} to the deepest leaf {shown(tip)}; its joints are {listed}"
    file = Path(label).name
    remedy = (
        f"where another is meant, write a robot file with kinematics: {{{kind}: {{file: {file}, base: …, tip: …}}}}"
    )
    return ResultWarning(code="default-chain", joint=None, text=one_line(text), remedy=one_line(remedy))


def rigid_branch_note(label: str, joints: Sequence[str], mass: float, following: Sequence[str] = ()) -> ResultWarning:
    """Which joints beside the chain count as rigid, the `mass` that they move [kg], and who would follow it."""
    more = f" and {len(joints) - MOST_NAMES} more" if len(joints) > MOST_NAMES else ""
    names = ", ".join(map(shown, joints[:MOST_NAMES])) + more
    verbs = ("moves", "counts") if len(joints) == 1 else ("move", "count")
    text = f"{label}: joint {names} {verbs[0]} beside the chain and {verbs[1]} as rigid, with {mass:.4g} kg"
    if following:
        text += f"; the motion of {', '.join(map(shown, following[:MOST_NAMES]))} with the chain is left out"
    remedy = f"state its position in the robot file where it is not zero, as in locked: {{{joints[0]}: 0.02}}"
    return ResultWarning(code="rigid-branch", joint=None, text=one_line(text), remedy=one_line(remedy))
