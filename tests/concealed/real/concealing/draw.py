"""A trial drawn from a seed: the set, one effect or two, where, and how large."""

import zlib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from concealed.real.concealing.concealment import Concealment
from concealed.real.concealing.ground import Ground, ground_of_set
from concealed.real.concealing.kinds import KINDS
from concealed.real.concealing.oracle import Estimate, estimate_sizes
from concealed.real.concealing.passage import with_effort
from concealed.real.concealing.recorded_sets import CYCLE, set_of_seed
from concealed.real.concealing.robot_file import copy_robot
from concealed.real.concealing.sizing import multiple_left, size_for
from tauscope.recording import Recording, write_recording

Array = NDArray[np.float64]

MULTIPLES = (0.7, 1.5, 3.0)
"""Sizes, in plain residuals of the joint."""

OWN_SHARE = (-0.3, 1.0)
"""What the untouched set holds of the same effect, relative to the size that is concealed. Where it holds more, the
effect is there already or the motion cannot tell it; where it takes away more, there is little left to be found."""

SPREAD = 0.1
"""Relative spread about them: no two trials are alike."""

PAIRS = 0.2
"""Share of trials that conceal two effects."""

OF_ONE_KIND = 12
"""Draws of the kind that is a seed's turn, before any other kind may take its place."""

MOST_ATTEMPTS = 150
"""Draws at one multiple; where none is physical the next smaller one is taken."""

SALT = zlib.crc32(b"real-concealed")


@dataclass(frozen=True, eq=False)
class Sized:
    """One effect with its size.

    multiple : float
        of the plain residual of its joint, as it was drawn; None for a sign, whose size nobody chooses
    reached : float
        the same, as it is
    before : Estimate
        of the same effect in the untouched set, by the oracle
    """

    concealment: Concealment
    size: float
    multiple: float | None
    reached: float
    before: Estimate

    @property
    def total(self) -> float:
        """What the trial holds of the effect: the untouched set may hold some already."""
        return total_size(self.concealment, self.size, self.before.size)

    def as_dict(self, ground: Ground) -> dict[str, Any]:
        """Plain data."""
        return {
            "kind": self.concealment.kind,
            "joint": ground.names[self.concealment.joint],
            "multiple": self.multiple,
            "reached": self.reached,
            "size": self.size,
            "parameters": self.concealment.parameters(self.size),
            "before": self.before.size,
            "total": self.concealment.parameters(self.total),
            "constants": dict(self.concealment.constants),
        }


@dataclass(frozen=True, eq=False)
class RealCase:
    """A trial before it is written."""

    seed: int
    set_name: str
    ground: Ground
    effects: tuple[Sized, ...]

    @property
    def name(self) -> str:
        return f"real-{self.set_name}-{self.seed}"

    def write(self, folder: Path) -> None:
        """The files as the diagnosis sees them."""
        source = self.ground.folder
        copy_robot(source, folder)
        for each in self.effects:
            if each.concealment.rewrite is not None:
                each.concealment.rewrite(each.size, source, folder)
        for number, passage in enumerate(self.ground.passages):
            write_recording(self.recording(number), folder / Path(passage.recording.name).name)

    def recording(self, number: int) -> Recording:
        """One recording of the set with all that is concealed in its torque."""
        passage = self.ground.passages[number]
        torque, kept = passage.torque.copy(), slice(None)
        for each in self.effects:
            if each.concealment.torque is not None:
                torque += each.size * each.concealment.torque(passage, self.ground.load[number])
        for each in self.effects:
            if each.concealment.report is not None:
                torque = each.concealment.report(passage.with_torque(torque), each.size)
                if each.concealment.kind.startswith("delay"):  # nobody knows the torque beyond the recording
                    beyond = int(np.ceil(each.size * passage.rate_hz))
                    kept = slice(beyond, None) if each.concealment.constants["side"] > 0.0 else slice(0, -beyond)
        return with_effort(passage.recording, torque / passage.gain, kept)


@lru_cache(maxsize=4)
def draw_case(seed: int, set_name: str | None = None) -> RealCase:
    """The trial of a seed; on a certain set where one is named.

    A draw that its rule refuses, or whose wanted size is not physical, is drawn again.
    """
    name = set_name or set_of_seed(seed)
    ground, rng = ground_of_set(name), np.random.default_rng([seed, SALT])
    mixed = np.random.default_rng([seed // len(CYCLE), SALT]).permutation(list(KINDS))
    first = _draw_sized(ground, rng, str(mixed[seed % len(CYCLE)]))
    effects = [first]
    if rng.random() < PAIRS:
        second = _draw_sized(ground, rng, None, beside=first)
        effects.append(second)
    return RealCase(seed, name, ground, tuple(effects))


def _draw_sized(ground: Ground, rng: np.random.Generator, kind: str | None, beside: Sized | None = None) -> Sized:
    first = int(rng.integers(len(MULTIPLES)))
    for multiple in MULTIPLES[first::-1]:
        for attempt in range(MOST_ATTEMPTS):
            own_turn = kind is not None and attempt < OF_ONE_KIND
            found = _attempt(ground, rng, kind if own_turn else None, multiple, beside)
            if found is not None:
                return found
    raise ValueError(f"{ground.folder.name}: no effect that is drawn is physical")


def _attempt(
    ground: Ground, rng: np.random.Generator, kind: str | None, multiple: float, beside: Sized | None
) -> Sized | None:
    """One draw, of a kind where one is named; None where a rule refuses it or its size is not physical."""
    this, joint = kind or str(rng.choice(list(KINDS))), int(rng.integers(ground.robot.joint_count))
    drawn = KINDS[this](ground, joint, rng)
    if drawn is None or (drawn.fixed is not None and kind is None):  # signs fit everywhere: they wait their turn
        return None
    if beside is not None and not _go_together(beside.concealment, drawn):
        return None
    wanted = multiple * float(rng.uniform(1.0 - SPREAD, 1.0 + SPREAD))
    size = size_for(ground, drawn, wanted)
    if size is None:
        return None
    (before,) = estimate_sizes(ground, [drawn], start=0.0) or [Estimate(0.0, 0.0)]
    if not OWN_SHARE[0] <= total_size(drawn, size, before.size) / size - 1.0 <= OWN_SHARE[1]:
        return None
    return Sized(drawn, size, None if drawn.fixed else multiple, multiple_left(ground, drawn, size), before)


def total_size(concealment: Concealment, size: float, before: float) -> float:
    """What a trial holds of an effect of which the untouched set holds something; a limit or a sign holds alone."""
    if concealment.fixed is not None or concealment.kind == "saturation":
        return size
    if concealment.kind == "gain_joint":  # one factor after the other
        side = float(concealment.constants["side"])
        return side * ((1.0 + side * size) * (1.0 + side * before) - 1.0)
    return size + before


def _go_together(one: Concealment, other: Concealment) -> bool:
    """Whether two effects can be told in one trial: of other kinds, only one of them in the robot file or a sign."""
    rare = [each.rewrite is not None or each.fixed is not None for each in (one, other)]
    return one.kind != other.kind and not all(rare) and not set(one.labels) & set(other.labels)
