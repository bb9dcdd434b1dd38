"""Generalised coordinates of the plant: every link, and the motors that do not turn with their link."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Coordinates:
    """Places of links and motors in the coordinate vector p and the velocity vector v, both (N,).

    Link j has place j. The motor of a rigid joint moves with its link and shares its place; the motors of compliant
    joints stand behind the links: N = n + number of compliant joints. All in joint units: a motor's angle is divided by
    its gear ratio.

    `compliant`: joints whose transmission gives way, counted from 0, ascending.
    """

    joint_count: int
    compliant: tuple[int, ...] = ()

    @property
    def size(self) -> int:
        """Number of coordinates N."""
        return self.joint_count + len(self.compliant)

    def motor(self, joint: int) -> int:
        """Place of a joint's motor. `joint`: counted from 0."""
        if joint in self.compliant:
            return self.joint_count + self.compliant.index(joint)
        return joint

    @property
    def motors(self) -> list[int]:
        """Places of all motors, one a joint."""
        return [self.motor(joint) for joint in range(self.joint_count)]
