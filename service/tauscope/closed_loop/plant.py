"""The simulator of a rollout, found by its entry point: MuJoCo is in the ``sim`` extra."""

from collections.abc import Callable, Sequence
from importlib.metadata import entry_points
from typing import Protocol, cast

from tauscope.errors import TauscopeError
from tauscope.extras import require_extra
from tauscope.recording.recording import Array

ENTRY_POINT_GROUP = "tauscope.rollout"

STEP_S = 1e-3  # step of the simulation [s]: loops of servos run at 1 kHz


class Plant(Protocol):
    """An arm in a simulator, one step at a time."""

    def reset(self, position: Array, velocity: Array) -> None:
        """Put the joints at a position (n,) [rad or m] with a velocity (n,) [rad/s or m/s]."""
        ...

    def advance(self, torque: Array, dry: Array) -> None:
        """One step with torque on the joints (n,) and levels of dry friction (n,) [Nm or N]."""
        ...

    @property
    def position(self) -> Array:
        """q, (n,) [rad or m]."""
        ...

    @property
    def velocity(self) -> Array:
        """q̇, (n,) [rad/s or m/s]."""
        ...

    @property
    def load(self) -> Array:
        """Torque of the rigid body in the last step, (n,) [Nm or N]."""
        ...


# Makes a plant of an MJCF, its driven joints, base first, the step [s], and the damping of their loops, (n,).
PlantMaker = Callable[[str, Sequence[str], float, Array], Plant]


def make_plant(mjcf: str, joints: Sequence[str], damping: Array) -> Plant:
    """The plant of an MJCF; `damping`: (n,), torque per velocity of the loops, integrated implicitly.

    Raises MissingExtraError without MuJoCo, and TauscopeError where no simulator is registered.
    """
    for entry in entry_points(group=ENTRY_POINT_GROUP):
        with require_extra("tauscope rollout"):
            maker = cast("PlantMaker", entry.load())
        return maker(mjcf, joints, STEP_S, damping)
    raise TauscopeError("no simulator for rollouts is registered; install tauscope again, with its sim extra")
