"""Encoders on the links: by how much each link lags its motor, and which columns are no encoder at all."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tauscope.recording.recording import Recording
from tauscope.recording.samples import Array, Samples
from tauscope.result_warning import ResultWarning
from tauscope.robot.robot import JointType

# Usual deflection over the motion's rms from which a column is in another unit or of another joint: no transmission
# that carries an arm gives way so far.
FOLLOWS = 0.2
USUAL = 0.95  # share of the samples whose deflection is usual: glitches of an encoder are rarer than the rest
# Deflection over the usual one from which a sample is a glitch: under a sudden load it is three or four times that.
GLITCH = 10.0
LEAST_MOTION = 0.05  # motion, rms, below which a joint rests and its two encoders show their noise [rad or m]
ONE_TURN = 2.0 * np.pi


@dataclass(frozen=True, eq=False)
class LinkEncoders:
    """What the columns qlink say."""

    lag: Array  # (N, n), q - qlink less whole turns and its median [rad or m]; NaN where either is missing or a glitch
    joints: tuple[int, ...]  # joints, from 0, that have an encoder on the link
    copies: tuple[int, ...]  # joints whose column repeats q
    strangers: tuple[int, ...]  # joints whose column does not move with q


def find_link_encoders(samples: Samples, types: Sequence[JointType]) -> LinkEncoders | None:
    """Encoders on the links; None where there are no such columns."""
    if samples.link_position is None:
        return None
    lag = samples.position - samples.link_position
    found: dict[str, list[int]] = {"joints": [], "copies": [], "strangers": []}
    for joint in range(lag.shape[1]):
        known = np.isfinite(lag[:, joint])
        own = lag[known, joint]
        if not len(own):
            continue
        is_copy = not own.any()
        if types[joint] is JointType.REVOLUTE:
            own = own - ONE_TURN * np.rint((own - own[0]) / ONE_TURN)
        motion = max(float(samples.position[known, joint].std()), LEAST_MOTION)
        own = own - np.median(own)
        usual = float(np.quantile(np.abs(own), USUAL))
        kind = "copies" if is_copy else "joints" if usual <= FOLLOWS * motion else "strangers"
        found[kind].append(joint)
        is_glitch = np.abs(own) > (GLITCH * usual if usual > 0.0 else FOLLOWS * motion)
        lag[known, joint] = np.where(is_glitch, np.nan, own)
    return LinkEncoders(lag, **{name: tuple(joints) for name, joints in found.items()})


def link_warnings(
    recording: Recording, types: Sequence[JointType], joints: Sequence[str | None]
) -> list[ResultWarning]:
    """A warning about each column that is no encoder on a link."""
    if not recording.has("qlink"):
        return []
    found = find_link_encoders(recording.samples(), types)
    if found is None:
        return []
    copy = "repeats column q{0}: it is no second encoder, and is not used", "record the encoder on the link itself"
    strange = "does not move with column q{0}; it is not used", "check its unit, its sign and its joint"
    warnings = []
    for places, (what, remedy) in ((found.copies, copy), (found.strangers, strange)):
        for joint in places:
            text = f"column qlink{joint + 1} {what.format(joint + 1)}"
            warnings.append(ResultWarning(code="link-encoder", joint=joints[joint], text=text, remedy=remedy))
    return warnings
