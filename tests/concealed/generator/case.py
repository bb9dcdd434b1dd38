"""What is concealed where: drawn from a series' name and a seed, so that anybody can draw it again."""

import zlib
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from concealed.generator.arms import arm_named
from concealed.generator.concealment import (
    Concealed,
    concealed_effects,
    concealed_form,
    concealed_signs,
    concealed_unknown,
)
from concealed.generator.effects import CATALOGUE, EVENTS
from concealed.generator.forms import FORMS
from concealed.generator.motions import STEPWISE
from concealed.generator.sensing import CORRELATION
from concealed.generator.strength import Reference
from concealed.generator.trial import Trial, recorded_trial
from concealed.generator.unknown import UNKNOWN

Place = tuple[str, int]
"""An effect, form or law, and its joint counted from 0."""

MOTIONS = 4
"""Campaigns of motions an arm has: few, so that what is simulated once serves often."""

SEEDS_OF_A_CAMPAIGN = 10_000
"""So many seeds on end share their arms' campaigns: reports see motions that development never saw."""

ARMS = {"paper": 0.4, "six": 0.2, "seven": 0.2, "linear": 0.2}
"""Arms and how often each is drawn."""

DRY_ARMS = {"servo-dry": 0.4, "paper-dry": 0.2, "six-dry": 0.2, "seven-dry": 0.2}
"""The same for motion with rest in it."""

SENSORS: tuple[dict[str, Any], ...] = (
    {"kind": "coloured"},
    {"kind": "heavy"},
    {"encoder_step": 2e-4},
    {"position_std": 1e-4},
    {"every": 2},
    {"dropped": 0.01},
    {"states_periods": False},
)
"""What is wrong with the recordings of the series that end in ``-sensing``."""

COARSE: tuple[dict[str, Any], ...] = ({"encoder_step": 2.0 * np.pi / 4096},)
"""What is wrong with those that end in ``-coarse``: 12 bit a turn, as small servos have it."""

TWELVE_BIT = 2.0 * np.pi / 4096
"""One count [rad]."""

POOR: tuple[dict[str, Any], ...] = (
    {"every": 2, "encoder_step": TWELVE_BIT, "position_std": 0.0},
    {"every": 4, "encoder_step": TWELVE_BIT, "position_std": 0.0, "torque_step": 1.0},
    {"every": 6},
    {"every": 2, "torque_step": 1.0},
    {"every": 2, "kind": "autoregressive"},
    {"every": 4, "kind": "autoregressive"},
    {"every": 2, "bunched": 0.05},
    {"every": 2, "dropouts": 2},
    {"every": 1, "held": 4},
    {"every": 3, "dropped": 0.02, "encoder_step": TWELVE_BIT, "position_std": 0.0},
)
"""What first recordings of small and of industrial arms are like: 33 to 100 Hz, or 50 Hz held at 200 Hz."""

SIGN, SIGNS = "wrong_sign", "wrong_signs"
"""Places of series that turn the sign of a joint's torque, or of all joints'."""

TURNING = ("paper", "six", "seven")
"""Arms without a linear axis, whose encoder no turn is divided by."""


@dataclass(frozen=True)
class Case:
    """One trial before it is made.

    series : str
        what is tried
    seed : int
        of everything that is drawn
    arm : str
        its name
    places : tuple of (str, int)
        what is concealed, and at which joint
    wanted : float
        s of each
    kind : str
        of the training motions
    motion_seed : int
        of the motions
    sensors : dict
        in what the recordings differ from good ones
    logs_current : bool
        whether the files hold currents, and the robot file the constants that turn them into torque
    """

    series: str
    seed: int
    arm: str
    places: tuple[Place, ...] = ()
    wanted: float = 0.0
    kind: str = "rich"
    motion_seed: int = 0
    sensors: dict[str, Any] = field(default_factory=dict)
    logs_current: bool = False

    @property
    def name(self) -> str:
        """One that no other case has."""
        return f"{self.series}-{self.arm}-{self.seed}"

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return asdict(self)

    def concealed(self) -> Concealed:
        """What the arm conceals, as strong as it could be made."""
        drawn = {"motion_seed": self.motion_seed, "seed": self.seed}
        if not self.places:
            return Concealed()
        (what, joint), *_ = self.places
        if what in UNKNOWN:
            return concealed_unknown(self.arm, what, joint, self.wanted, **drawn)
        if what in FORMS:
            return concealed_form(self.arm, what, joint, self.wanted, **drawn)
        if what in (SIGN, SIGNS):
            return concealed_signs(joint if what == SIGN else None, arm_named(self.arm).joint_count)
        return concealed_effects(self.arm, self.places, self.wanted, reference=self.reference, **drawn)

    @property
    def reference(self) -> Reference:
        """What s is stated of: rich motion and good sensors, but stepwise motion by itself and by its own logger."""
        if self.kind not in STEPWISE:
            return Reference()
        correlation = CORRELATION if self.sensors.get("kind") == "autoregressive" else 0.0
        every = self.sensors.get("every", 1) * self.sensors.get("held", 1)
        return Reference(self.kind, every, correlation)

    def recorded(self, concealed: Concealed) -> Trial:
        """The trial itself."""
        drawn = {"motion_seed": self.motion_seed, "seed": self.seed}
        return recorded_trial(self.arm, concealed, motion=self.kind, **drawn, **self.sensors)


@dataclass(frozen=True)
class Series:
    """Cases of one kind.

    words : str
        what it tries
    from_ : tuple of str
        what may be concealed; none for sound arms
    count : int
        how much of it at once
    strengths : tuple of float
        s, one of them is drawn
    kinds : tuple of str
        training motions, one is drawn
    sensors : tuple of dict
        what is wrong with the recordings, one is drawn
    logs_current : bool
        whether the files hold currents
    arms : tuple of str
        on which; one is drawn
    first : str or None
        effect that each case has, beside those that are drawn
    at_one_joint : bool
        whether all effects of a case are at the same joint
    """

    words: str
    from_: tuple[str, ...] = ()
    count: int = 0
    strengths: tuple[float, ...] = (0.0,)
    kinds: tuple[str, ...] = ("rich",)
    sensors: tuple[dict[str, Any], ...] = ({},)
    logs_current: bool = False
    arms: tuple[str, ...] = tuple(ARMS)
    first: str | None = None
    at_one_joint: bool = False


_EFFECTS = tuple(CATALOGUE)
_RIGID = tuple(effect for effect in CATALOGUE if effect not in ("joint_elasticity", "backlash", "rotor_inertia"))
"""Of which any two can be at one joint."""

_STEPWISE: dict[str, Any] = {"kinds": tuple(STEPWISE), "sensors": POOR, "arms": tuple(DRY_ARMS)}
SERIES: dict[str, Series] = {
    "sound": Series("nothing is concealed"),
    "sound-sensing": Series("nothing is concealed, and the recordings are poor", sensors=SENSORS),
    "sound-coarse": Series("nothing is concealed, and the encoders have 12 bit", sensors=COARSE, arms=TURNING),
    "weak": Series("one effect, s = 8", _EFFECTS, 1, (8.0,)),
    "moderate": Series("one effect, s = 15", _EFFECTS, 1, (15.0,)),
    "strong": Series("one effect, s = 40", _EFFECTS, 1, (40.0,)),
    "pair": Series("two effects, s = 40 each", _EFFECTS, 2, (40.0,)),
    "triple": Series("three effects, s = 40 each", _EFFECTS, 3, (40.0,)),
    "form": Series("an effect under another formula than the catalogue's", tuple(FORMS), 1, (20.0, 40.0)),
    "unknown": Series("something that no catalogue has", tuple(UNKNOWN), 1, (40.0,)),
    "aliased": Series(
        "one effect, and training motion too narrow or too slow", _EFFECTS, 1, (40.0,), ("narrow", "slow")
    ),
    "strong-sensing": Series("one effect, and the recordings are poor", _EFFECTS, 1, (20.0, 40.0), sensors=SENSORS),
    "strong-coarse": Series(
        "one effect, and the encoders have 12 bit", _EFFECTS, 1, (40.0,), sensors=COARSE, arms=TURNING
    ),
    "event": Series("something that happens for a while", tuple(EVENTS), 1, (15.0, 40.0)),
    "constant": Series(
        "currents under a wrong nominal torque_constant", ("torque_gain_error",), 1, (15.0, 40.0), logs_current=True
    ),
    "pair-one-joint": Series("two effects at one joint, s = 40 each", _RIGID, 2, (40.0,), at_one_joint=True),
    "drift-beside": Series(
        "friction that drifts, and another effect, s = 40 each", _EFFECTS, 2, (40.0,), first="friction_drift"
    ),
    "sign": Series("the torque of one joint, or of all, has the wrong sign", (SIGN, SIGNS), 1),
    "sound-poor": Series("nothing is concealed; jogs or points, poor sensors", **_STEPWISE),
    "poor": Series("one effect; jogs or points, poor sensors", _EFFECTS, 1, (15.0, 40.0), **_STEPWISE),
    "sign-poor": Series(
        "the torque of one joint, or of all, has the wrong sign; jogs or points, poor sensors",
        (SIGN, SIGNS),
        1,
        **_STEPWISE,
    ),
}


def drawn(series: str, seed: int, arm: str | None = None, attempt: int = 0) -> Case:
    """The case of a series that a seed stands for; at a certain arm where one is named.

    A further attempt draws another effect, where the first could not be made as strong as wanted.
    """
    told, rng = SERIES[series], np.random.default_rng([seed, zlib.crc32(series.encode()), attempt])
    chances = np.array([(ARMS | DRY_ARMS)[name] for name in told.arms])
    some = str(rng.choice(told.arms, p=chances / chances.sum()))
    where = arm or some
    joints = arm_named(where).joint_count
    places: list[Place] = [] if told.first is None else [(told.first, int(rng.integers(joints)))]
    while len(places) < told.count:
        place = (str(rng.choice(told.from_)), int(rng.integers(joints)))
        if told.at_one_joint and places:
            place = (place[0], places[0][1])
        if place[0] not in [what for what, _ in places]:
            places.append(place)
    return Case(
        series,
        seed,
        where,
        tuple(places),
        float(rng.choice(told.strengths)),
        str(rng.choice(told.kinds)),
        seed // SEEDS_OF_A_CAMPAIGN * MOTIONS + int(rng.integers(MOTIONS)),
        dict(told.sensors[int(rng.integers(len(told.sensors)))]),
        told.logs_current,
    )
