"""What an effect adds to the equations of motion, and what the plant needs of an effect.

The equations of a rigid joint j are, in joint units,

    u_j = J_j q̈_j + friction_j + motor_j + L_j (1 + g_j) + |L_j| f_j,     L = H(q) q̈ + h(q, q̇) + c(q) + link

where u is the drive's torque and L the load: the torque that the transmission hands to the link. `friction`, `motor`,
`link`, and the load's gains g and f are what terms fill in. All are signed as what the drive has to overcome.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.linalg.lapack import dgesv

from tauscope.errors import ScenarioError
from tauscope.robot.robot import Array, Robot
from tauscope_sim.plant.rigid_bodies import RigidBodies


@dataclass(frozen=True)
class Coordinates:
    """Places of links and motors in the coordinate vector p and the velocity vector v, both (N,).

    Link j has place j. The motor of a rigid joint moves with its link and shares its place; the motors of compliant
    joints stand behind the links: N = n + number of compliant joints. All in joint units: a motor's angle is divided by
    its gear ratio.
    """

    joint_count: int
    compliant: tuple[int, ...] = ()  # joints whose transmission gives way, counted from 0, ascending

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


AMBIENT = 25.0  # temperature of joints that no effect heats [°C]


class Moment:
    """The state at which terms are evaluated; plain lists, because terms read single numbers."""

    def __init__(self, coordinates: Coordinates, bodies: RigidBodies) -> None:
        self.bodies = bodies
        self.time = 0.0  # instant since the arm was placed [s]
        self.position = [0.0] * coordinates.size  # p, by coordinate [rad or m]
        self.velocity = [0.0] * coordinates.size  # v, by coordinate [rad/s or m/s]
        self.states: list[float] = []  # internal states of the terms
        self.load = [0.0] * coordinates.joint_count
        """L, by joint: known to `Term.linearise` and `Term.rates`, not yet to `Term.act` [Nm or N]"""
        self.friction = [0.0] * coordinates.joint_count
        """all friction of each joint, that of its load included; known like `load` [Nm or N]"""


class Forces:
    """Torque that the drives have to overcome, summed over the terms; lists by joint, as in `Moment`."""

    def __init__(self, joint_count: int) -> None:
        self._none = [0.0] * joint_count
        self.clear()

    def clear(self) -> None:
        """Begin a sum."""
        self.friction = self._none.copy()  # friction on the motor's side [Nm or N]
        self.motor = self._none.copy()  # anything else on the motor's side [Nm or N]
        self.link = self._none.copy()  # on the link's side: part of the load [Nm or N]
        self.load_gain = self._none.copy()  # g, torque a unit of load
        self.load_friction = self._none.copy()  # f, torque a unit of the load's magnitude; counts as friction


class Slopes:
    """Derivatives for the implicit part of the integration; an approximate one costs stability, not order."""

    def __init__(self, size: int, state_count: int) -> None:
        total = size + state_count
        self.all = np.zeros((3, total, total))
        self.by_position: Array = self.all[0, :size, :size]
        """derivative of each coordinate's torque with respect to p, (N, N)"""
        self.by_velocity: Array = self.all[1, :size, :size]  # with respect to v, (N, N)
        self.by_state: Array = self.all[2, :size, size:]  # with respect to the internal states, (N, m)
        self.rate_by_position: Array = self.all[0, size:, :size]
        """derivative of the internal states' rates with respect to p, (m, N)"""
        self.rate_by_velocity: Array = self.all[1, size:, :size]  # with respect to v, (m, N)
        self.rate_by_state: Array = self.all[2, size:, size:]  # with respect to the internal states, (m, m)


class Term:
    """One contribution to the equations of motion; a subclass overrides the hooks that it needs."""

    state_count: int = 0  # number of internal states
    first_state: int = 0  # place of the first of them in `Moment.states`, set by the equations of motion
    depends_on_load: bool = False  # whether `act` fills in `Forces.load_gain` or `Forces.load_friction`
    event_times: tuple[float, ...] = ()
    """instants at which the term changes abruptly; the integration never steps across one [s]"""

    def initial_states(self) -> tuple[float, ...]:
        """Internal states of an arm that rests."""
        return ()

    def begin(self, time: float, bodies: RigidBodies) -> None:
        """Take note that an interval without events begins at `time`: the placing, or one of `event_times` [s]."""

    def act(self, moment: Moment, forces: Forces) -> None:
        """Add the torque that the drives have to overcome."""

    def linearise(self, moment: Moment, slopes: Slopes) -> None:
        """Add the derivatives of torque and rates."""

    def rates(self, moment: Moment, rates: list[float]) -> None:
        """Write the rates of the term's own internal states."""

    def report_temperature(self, states: list[float], temperature: Array) -> None:
        """Write the temperature of the joints that the term heats. `temperature`: (n,), of all joints [°C]."""


class Transmission(Protocol):
    """A transmission that gives way: torque by the motor's lead over the link."""

    @property
    def joint(self) -> int:
        """Number of its joint, counted from 1."""
        ...

    @property
    def rotor_inertia(self) -> float:
        """Reflected inertia of the motor [kg m² or kg]."""
        ...

    def torque(self, twist: float, twist_rate: float) -> float:
        """Torque on the link [Nm or N]. `twist`: motor less link position [rad or m]; `twist_rate`: its rate."""
        ...

    def torque_slopes(self, twist: float, twist_rate: float) -> tuple[float, float]:
        """∂τ/∂twist [Nm/rad] and ∂τ/∂rate [Nm s/rad]. `twist`: motor less link position [rad or m]."""
        ...

    def twist_at_rest(self, torque: float) -> float:
        """Twist at which a resting joint transmits a torque [rad or m]. `torque`: that the link needs [Nm or N]."""
        ...


class PhysicalEffect:
    """What the plant asks of a concealed effect; a subclass overrides what it changes.

    All torques are signed as what the drive has to overcome in addition: measured = rigid bodies + friction + effect.
    """

    def alter(self, robot: Robot) -> Robot:
        """The arm as it really is, before its model is built."""
        return robot

    def added_rotor_inertia(self, robot: Robot) -> Array:
        """Reflected inertia of the motors of rigid joints, (n,) [kg m² or kg]."""
        return np.zeros(robot.joint_count)

    def transmission(self) -> Transmission | None:
        """The compliant transmission that it makes of a joint, if it does."""
        return None

    def terms(self, robot: Robot, coordinates: Coordinates) -> tuple[Term, ...]:
        """What it adds to the equations of motion."""
        return ()


MOST_SIGN_CHANGES = 60  # sign patterns that are tried; a handful is needed, and the solution exists and is unique
LARGEST_GAIN = 0.95  # largest torque a unit of load that a transmission may lose: at 1 it is self-locking


def loaded_accelerations(
    mass_matrix: Array, drive: Array, link_side: Array, gain: Array, friction: Array, load: Array
) -> tuple[Array, Array, Array]:
    """Solve u = J q̈ + L (1 + g) + |L| f with L = (H - J) q̈ + h for q̈: the load's algebraic loop, in closed form.

    For given signs of L it is linear: with D = diag(g + f sgn L),

        (H + D (H - J)) q̈ = u - (1 + D) h.

    The signs are corrected until they agree with the L that they lead to. H - J is positive definite and 1 + D is
    positive, so the matrix is regular with a positive determinant for every pattern of signs: there is exactly one
    solution, without a lag of one step. Raises ScenarioError where a transmission would lose more than `LARGEST_GAIN`
    of its load.

    `mass_matrix`: (2, n, n), H with the rotors J on its diagonal, and H - J without [kg m² or kg].
    `drive`: (n,), u less what does not depend on the load [Nm or N].
    `link_side`: (n,), h, torque on the link's side [Nm or N].
    `gain`, `friction`: (n,), g and f of each joint, f zero or of any sign; |g| + |f| below 1.
    `load`: (n,), L, a first guess of which only the signs count [Nm or N].
    Returns q̈, (n,) [rad/s² or m/s²]; L, (n,) [Nm or N]; H + D (H - J) at the solution, (n, n) [kg m² or kg].
    """
    worst = int(np.argmax(np.abs(gain) + np.abs(friction)))
    if not abs(gain[worst]) + abs(friction[worst]) <= LARGEST_GAIN:
        raise ScenarioError(
            f"joint {worst + 1}: friction and ripple of its load add up to {abs(gain[worst]) + abs(friction[worst]):g} "
            f"of the load; make them at most {LARGEST_GAIN:g} together, or the transmission locks itself"
        )
    with_rotors, links_only = mass_matrix
    for _ in range(MOST_SIGN_CHANGES):
        loss = gain + friction * np.sign(load)
        matrix = with_rotors + loss[:, None] * links_only
        acceleration = dgesv(matrix, drive - (1.0 + loss) * link_side)[2]
        found = links_only @ acceleration + link_side
        wrong = friction * (np.sign(found) - np.sign(load)) * found
        if not np.any(wrong):
            break
        # one sign at a time, the last joint first: this order (Murty's) never cycles
        last = int(np.flatnonzero(wrong)[-1])
        load = load.copy()
        load[last] = found[last]
    return acceleration, found, matrix
