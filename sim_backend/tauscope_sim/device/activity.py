"""What the simulated drives are doing, and from which of it they may change to which."""

from enum import StrEnum

from tauscope_drivers import ControlMode, StopPolicy


class Activity(StrEnum):
    """What the drives do with the arm."""

    BRAKED = "braked"  # never yet under power: the brakes carry the arm, which stands still
    TRACKING = "tracking"  # following the host's positions
    TORQUE = "torque"  # giving the torque that the host commands
    HOLDING = "holding"  # stopped; under power where it stands
    DAMPING = "damping"  # stopped; resisting motion in proportion to speed
    FREE = "free"  # stopped; no torque and no brake: an arm that is not balanced falls


COMMANDED = frozenset({Activity.TRACKING, Activity.TORQUE})
"""What needs the host's setpoints: here the watchdog is armed."""

POWERED = COMMANDED | {Activity.HOLDING, Activity.DAMPING}  # where the drives hold or drive the joints

TRANSITIONS: dict[Activity, frozenset[Activity]] = {
    Activity.BRAKED: COMMANDED,
    Activity.TRACKING: frozenset({Activity.HOLDING, Activity.DAMPING, Activity.FREE}),
    Activity.TORQUE: frozenset({Activity.HOLDING, Activity.DAMPING, Activity.FREE}),
    Activity.HOLDING: COMMANDED | {Activity.DAMPING, Activity.FREE},
    Activity.DAMPING: COMMANDED | {Activity.HOLDING, Activity.FREE},
    Activity.FREE: COMMANDED,
}
"""Allowed changes. A stop never puts an arm under power that has none: a braked arm stays braked, a free one free."""

_BY_MODE = {ControlMode.POSITION: Activity.TRACKING, ControlMode.TORQUE: Activity.TORQUE}
_BY_POLICY = {
    StopPolicy.HOLD: Activity.HOLDING,
    StopPolicy.DAMP: Activity.DAMPING,
    StopPolicy.TORQUE_OFF: Activity.FREE,
}


def commanded_by(mode: ControlMode) -> Activity:
    """What enabling leads to."""
    return _BY_MODE[mode]


def stopped_by(activity: Activity, policy: StopPolicy) -> Activity:
    """What a stop leads to; the activity itself where there is nothing to stop."""
    asked = _BY_POLICY[policy]
    return asked if asked in TRANSITIONS[activity] else activity
