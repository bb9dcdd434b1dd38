"""Whether time, angles and velocities can be in the unit that is stated.

Evidence in the order of its strength: recorded velocity against the positions' own, joint limits, full turns, and the
rates, speeds and lengths of motions that arms have. Sound recordings are never refused, so each rule leaves a factor of
ten or so to what any arm does; a wrong unit is a factor of 57 or more.
"""

import numpy as np

from tauscope.recording.examination.plausible_torque import find_implausible_torque
from tauscope.recording.examination.sketch import Sketch, joint_types, percentile
from tauscope.recording.recording import Recording
from tauscope.recording.units import METRES, RADIANS, SECONDS
from tauscope.robot.robot import JointType, Robot

SLOWEST_RATE_HZ = 2.0  # no arm's dynamics are sampled this slowly [Hz]; 1 kHz counted in ms seems to be 1 Hz
FASTEST_RATE_HZ = 2e5  # no drive is sampled this fast [Hz]
# Time from row to row times the time to cross a joint's range at its own top speed [s²]: a slow friction sweep of 300 s
# is sampled at 10 Hz or more. A clock in ms makes this product a million times larger.
SLOWEST = 30.0
LEAST_SWEEP = 0.05  # a range below this is rest, whatever its speed [rad or m]
FASTEST = 1e4  # a median speed above this is no joint's [rad/s or m/s]
SAME_RATIO = 0.1  # largest deviation of a ratio of velocities from a ratio of units
AGREEMENT = 0.25  # largest deviation of that ratio from 1 in which the units are taken to agree
STEADY_RATIO = 0.3  # largest quartile distance, relative to the median, of a ratio that is one
FAST_PART = 0.3  # share of the top velocity above which a row tells a ratio
FEWEST_ROWS = 20

SI_LENGTHS = ("rad", "m")

MANY_TURNS = 4.0 * np.pi  # most joints of an arm of three joints or more keep below two turns [rad]
LARGEST_DEGREES = 720.0  # whole numbers above this are no angles, in degrees neither: an encoder counts to 1024 or more
FASTEST_ARM = 60.0  # no arm of three joints or more has most joints faster than this [rad/s]: the fastest reach 20
QUARTER_TURN = 90.0  # span in degrees from which gravity's torque shows that it swings in degrees
LONGEST_SLIDE = 100.0  # no prismatic joint is longer [m]
# Share of the range by which a joint may be beyond its limits: offsets, and limits of another model.
BEYOND_LIMITS = 0.1


def find_implausible(recording: Recording, robot: Robot | None = None) -> str | None:
    """A column that can hardly be in the stated unit: its name, the evidence, and the option that mends it."""
    sketch, types = Sketch.of(recording), joint_types(recording, robot)
    return (
        _doubt_velocity(sketch, types)
        or _doubt_time(sketch)
        or _doubt_angle(sketch, types, robot)
        or find_implausible_torque(recording, sketch, robot)
    )


def _doubt(column: str, evidence: str, units: str = "") -> str:
    """A column that can hardly be in the stated unit; without `units`, the value for ``--units``, none is likely."""
    return f"column {column}: {evidence}; {f'read it with --units {units}' if units else 'write it in SI units'}"


def _doubt_velocity(sketch: Sketch, types: list[JointType]) -> str | None:
    """Recorded velocity against the positions' own: their ratio is a ratio of units."""
    ratios = _velocity_ratios(sketch)
    known = np.isfinite(ratios)
    if not known.any():
        return None
    typical = float(np.median(ratios[known]))
    if np.abs(ratios[known] / typical - 1.0).max() > AGREEMENT or abs(typical - 1.0) < AGREEMENT:
        return None
    joint = int(np.flatnonzero(known)[0])
    angles, lengths = {key: RADIANS[key] for key in ("rad", "deg")}, METRES
    positions = lengths if types[joint] is JointType.PRISMATIC else angles
    speeds = lengths if types[joint] is JointType.PRISMATIC else RADIANS
    fits = [
        (abs(typical / (SECONDS[t] * speeds[v] / positions[q]) - 1.0), t, q, v)
        for t in SECONDS
        for q in positions
        for v in speeds
    ]
    # Of equal ratios the one with fewest units other than SI: that of q and qd both in degrees is 1.
    deviation, time, position, speed = min(
        fits, key=lambda f: (f[0] > SAME_RATIO, len(_name_foreign_units(*f[1:])), f[0])
    )
    evidence = f"Δq/Δt is {typical:.3g} times column qd{joint + 1}"
    if deviation <= SAME_RATIO:
        column = "t" if time != "s" else f"q{joint + 1}" if position not in SI_LENGTHS else f"qd{joint + 1}"
        named = {"t": time, "q": position, "qd": speed}
        units = [f"{key}={unit}" for key, unit in named.items() if unit not in ("s", "rad", "m")]
        if position in ("deg", "mm") and speed in SI_LENGTHS:
            units.append(f"qd={speed}")
        return _doubt(
            column,
            f"{evidence}, the ratio of {' and '.join(_name_foreign_units(time, position, speed))}",
            ",".join(units),
        )
    if abs(sketch.interval - 1.0) < 1e-9:
        text = f"rises by 1 from row to row, and {evidence}: it counts samples of about {1.0 / typical:.4g} Hz"
        return _doubt("t", text, "t=index --rate HZ")
    return None


def _velocity_ratios(sketch: Sketch) -> np.ndarray:
    """Δq/Δt over recorded velocity, (n,); NaN where it is no steady ratio."""
    ratios = np.full(sketch.position.shape[1], np.nan)
    if sketch.velocity is None:
        return ratios
    for joint, (slope, velocity) in enumerate(zip(sketch.slope.T, sketch.velocity.T, strict=True)):
        known = np.isfinite(slope) & np.isfinite(velocity)
        if not known.any():
            continue
        fast = known & (np.abs(velocity) > FAST_PART * np.percentile(np.abs(velocity[known]), 99.0))
        if fast.sum() < FEWEST_ROWS:
            continue
        low, middle, high = np.percentile(slope[fast] / velocity[fast], [25, 50, 75])
        if middle > 0.0 and high - low < STEADY_RATIO * middle:
            ratios[joint] = middle
    return ratios


def _name_foreign_units(time: str, position: str, speed: str) -> list[str]:
    """The units that are not SI, in words."""
    words = (
        "" if time == "s" else f"{time} to s",
        "" if position in SI_LENGTHS else f"{position} to {'m' if position == 'mm' else 'rad'}",
        "" if speed in SI_LENGTHS else f"{speed} to {'m/s' if speed == 'mm' else 'rad/s'} in qd",
    )
    return [each for each in words if each]


def _doubt_time(sketch: Sketch) -> str | None:
    """Rates, and lengths of motions, that no arm's recording has."""
    ratios = _velocity_ratios(sketch)
    if (np.abs(ratios - 1.0) < AGREEMENT).any():
        return None  # the recorded velocity vouches for the clock
    interval = sketch.interval
    moving = sketch.span > LEAST_SWEEP
    moving &= sketch.top_speed > 0.0
    sweep = float(np.min(sketch.span[moving] / sketch.top_speed[moving])) if moving.any() else 0.0
    whole = "" if not moving.any() else f" and the fastest joint takes {sweep:.3g} s to cross its range"
    if interval >= 1.0 / SLOWEST_RATE_HZ or interval * sweep > SLOWEST:
        text = f"rows are {interval:.4g} s apart{whole}: this is hardly in seconds"
        if abs(interval - 1.0) < 1e-9:
            return _doubt("t", text, "t=ms where it counts ms, or --units t=index --rate HZ where it counts samples")
        unit = "ms" if interval < 50.0 else "us" if interval < 5e4 else "ns"
        return _doubt("t", text, f"t={unit}")
    if interval < 1.0 / FASTEST_RATE_HZ:
        return _doubt("t", f"rows are {interval:.3g} s apart: this is hardly in seconds")
    typical = np.nanmedian(np.abs(sketch.slope), axis=0) if np.isfinite(sketch.slope).any(axis=0).all() else np.zeros(1)
    joint = int(np.argmax(typical))
    if typical[joint] > FASTEST:
        text = f"q{joint + 1} moves at {typical[joint]:.3g} per second most of the time: one of both is in another unit"
        return _doubt(f"t or q{joint + 1}", text)
    return None


def _doubt_angle(sketch: Sketch, types: list[JointType], robot: Robot | None) -> str | None:
    """Positions that limits, or the number of turns, or gravity say are in degrees; or in mm."""
    known = sketch.position[np.isfinite(sketch.position)]
    if len(known) and sketch.reach.max() > LARGEST_DEGREES and (known == np.rint(known)).all():
        joint = int(np.argmax(sketch.reach))
        text = f"whole numbers up to {sketch.reach[joint]:.0f}, as counts of an encoder are"
        return _doubt(f"q{joint + 1}", text)
    revolute = np.array([kind is JointType.REVOLUTE for kind in types])
    for kind, unit, factor in ((revolute, "deg", np.pi / 180.0), (~revolute, "mm", 1e-3)):
        found = _find_beyond_limits(sketch, kind, factor, robot)
        if found is not None:
            joint, text = found
            return _doubt(f"q{joint + 1}", text, f"q={unit}")
    slides = ~revolute & (sketch.reach > LONGEST_SLIDE)
    if slides.any():
        joint = int(np.argmax(slides))
        return _doubt(f"q{joint + 1}", f"reaches {sketch.reach[joint]:.4g}, as a length in mm does", "q=mm")
    turned = revolute & (sketch.reach > MANY_TURNS)
    rushed = revolute & (percentile(np.abs(sketch.slope), 99.0) > FASTEST_ARM)
    for many, words, values, others in (
        (turned, "reaches {:.4g}", sketch.reach, "beyond two turns"),
        (rushed, "moves at {:.4g} per second", sketch.top_speed, "as fast"),
    ):
        if many.sum() >= max(2.0, revolute.sum() / 2.0) and len(types) >= 3:
            joint = int(np.argmax(np.where(many, sketch.reach, 0.0)))
            text = f"{words.format(values[joint])}, and {many.sum()} of {len(types)} joints are {others}"
            return _doubt(f"q{joint + 1}", f"{text}, as angles in degrees are", "q=deg")
    for joint in np.flatnonzero(revolute & (sketch.span > QUARTER_TURN)):
        if _swings_in_degrees(sketch, int(joint)):
            text = f"spans {sketch.span[joint]:.4g}, and its torque swings once in 360, not once in 2π"
            return _doubt(f"q{joint + 1}", text, "q=deg")
    return None


def _find_beyond_limits(sketch: Sketch, kind: np.ndarray, factor: float, robot: Robot | None) -> tuple[int, str] | None:
    """A joint that is beyond its limits most of the time, where another unit would keep all joints within theirs."""
    limits = [None if robot is None else joint.limits.position for joint in robot.joints] if robot else []
    beyond, judged = [], 0
    for joint, limit in enumerate(limits):
        position = sketch.position[:, joint]
        position = position[np.isfinite(position)]
        if limit is None or not kind[joint] or not len(position):
            continue
        low, high = limit
        spare = BEYOND_LIMITS * (high - low)
        outside = float(np.mean((position < low - spare) | (position > high + spare)))
        scaled = position * factor
        if scaled.min() < low - spare or scaled.max() > high + spare:
            return None
        judged += 1
        if outside > 0.5:
            beyond.append((outside, joint, low, high))
    if not beyond or len(beyond) < judged / 3.0:
        return None
    outside, joint, low, high = max(beyond)
    reach = sketch.reach[joint]
    if reach < 2.0 * max(abs(low), abs(high)) or (factor != METRES["mm"] and reach < MANY_TURNS):
        return None  # an offset of the encoder, or an angle that counts from 0 to 2π, and not a unit
    return joint, f"reaches {reach:.4g}, beyond its limits {low:.4g} to {high:.4g} in {100 * outside:.0f} % of the rows"


def _swings_in_degrees(sketch: Sketch, joint: int) -> bool:
    """Whether gravity's torque follows the angle as one in degrees, and not as one in radians."""
    angle, slope, torque = (
        values[:, joint] for values in (sketch.position_at_slope, sketch.slope, sketch.effort_at_slope)
    )
    known = np.isfinite(angle) & np.isfinite(slope) & np.isfinite(torque)
    if known.sum() < 10 * FEWEST_ROWS:
        return False
    angle, slope, torque = angle[known], slope[known], torque[known]
    plain = [np.ones_like(angle), angle, slope, np.sign(slope), np.gradient(slope)]

    def residual(*columns: np.ndarray) -> float:
        matrix = np.column_stack([*plain, *columns])
        matrix = matrix / np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
        return float(np.linalg.norm(torque - matrix @ np.linalg.lstsq(matrix, torque, rcond=None)[0]))

    in_degrees = residual(np.sin(np.radians(angle)), np.cos(np.radians(angle)))
    return in_degrees < 0.5 * min(residual(), residual(np.sin(angle), np.cos(angle)))
