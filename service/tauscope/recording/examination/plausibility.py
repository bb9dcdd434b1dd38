"""Whether time, angles, velocities and torque can be in the unit that is stated.

Evidence in the order of its strength: recorded velocity against the positions' own, joint limits, full turns, and the
rates, speeds and lengths of motions that arms have. Sound recordings are never refused, so each rule leaves a factor of
ten or so to what any arm does; a wrong unit is a factor of 57 or more.
"""

import numpy as np

from tauscope.recording.examination.scales import Sketch, joint_types, percentile
from tauscope.recording.recording import EffortKind, Recording
from tauscope.recording.samples import Array
from tauscope.recording.units import METRES, RADIANS, SECONDS
from tauscope.robot.kinematics import link_placements
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
        _doubt_effort(sketch)
        or _doubt_velocity(sketch, types)
        or _doubt_time(sketch)
        or _doubt_angle(sketch, types, robot)
        or find_implausible_torque(recording, sketch, robot)
    )


def _doubt(column: str, evidence: str, units: str = "") -> str:
    """A column that can hardly be in the stated unit; without `units`, the value for ``--units``, none is likely."""
    return f"column {column}: {evidence}; {f'read it with --units {units}' if units else 'write it in SI units'}"


def _doubt_effort(sketch: Sketch) -> str | None:
    """Efforts that are the velocities, at every joint: columns of a file without names, say, in another order."""
    ratios = _slope_ratios(sketch, sketch.effort_at_slope, SAME_RATIO)
    n = len(ratios)
    if n < 2 or not (np.abs(ratios - 1.0) < SAME_RATIO).all():
        return None
    return f"column tau1: tau1 to tau{n} are the velocities of q1 to q{n}; name the columns of torque by --columns"


def _doubt_velocity(sketch: Sketch, types: list[JointType]) -> str | None:
    """Recorded velocity against the positions' own: their ratio is a ratio of units."""
    ratios = _slope_ratios(sketch, sketch.velocity)
    known = np.isfinite(ratios)
    if not known.any():
        return None
    typical = float(np.median(ratios[known]))
    if np.abs(ratios[known] / typical - 1.0).max() > AGREEMENT or abs(typical - 1.0) < AGREEMENT:
        return None
    joint = int(np.flatnonzero(known)[0])
    # The usual units: among all of them, some ratio fits anything.
    angles, lengths = {key: RADIANS[key] for key in ("rad", "deg")}, {key: METRES[key] for key in ("m", "mm")}
    positions = lengths if types[joint] is JointType.PRISMATIC else angles
    speeds = lengths if types[joint] is JointType.PRISMATIC else {**angles, "rpm": RADIANS["rpm"]}
    fits = [
        (abs(typical / (SECONDS[t] * speeds[v] / positions[q]) - 1.0), t, q, v)
        for t in ("s", "ms", "us", "ns")
        for q in positions
        for v in speeds
    ]
    # Of equal ratios the first, which is in SI: that of q and qd both in degrees is 1.
    deviation, time, position, speed = min(fits, key=lambda fit: fit[0])
    evidence = f"Δq/Δt is {typical:.3g} times column qd{joint + 1}"
    if deviation <= SAME_RATIO:
        column = "t" if time != "s" else f"q{joint + 1}" if position not in SI_LENGTHS else f"qd{joint + 1}"
        named = {"t": time, "q": position, "qd": speed}
        units = [f"{key}={unit}" for key, unit in named.items() if unit not in ("s", *SI_LENGTHS)]
        if position in ("deg", "mm") and speed in SI_LENGTHS:
            units.append(f"qd={speed}")
        words = {
            "t": "s",
            "q": "m" if position == "mm" else "rad",
            "qd": "m/s in qd" if speed == "mm" else "rad/s in qd",
        }
        ratio = [f"{unit} to {words[key]}" for key, unit in named.items() if unit not in ("s", *SI_LENGTHS)]
        return _doubt(column, f"{evidence}, the ratio of {' and '.join(ratio)}", ",".join(units))
    if abs(sketch.interval - 1.0) < 1e-9:
        text = f"rises by 1 from row to row, and {evidence}: it counts samples of about {1.0 / typical:.4g} Hz"
        return _doubt("t", text, "t=index --rate HZ")
    return None


def _slope_ratios(sketch: Sketch, others: np.ndarray | None, steady: float = STEADY_RATIO) -> np.ndarray:
    """Δq/Δt over other columns, (n,); NaN where it is no steady ratio. `others`: (N, n), of the rows of the slope."""
    ratios = np.full(sketch.position.shape[1], np.nan)
    if others is None:
        return ratios
    for joint, (slope, other) in enumerate(zip(sketch.slope.T, others.T, strict=True)):
        known = np.isfinite(slope) & np.isfinite(other)
        if not known.any():
            continue
        fast = known & (np.abs(other) > FAST_PART * np.percentile(np.abs(other[known]), 99.0))
        if fast.sum() < FEWEST_ROWS:
            continue
        low, middle, high = np.percentile(slope[fast] / other[fast], [25, 50, 75])
        if middle > 0.0 and high - low < steady * middle:
            ratios[joint] = middle
    return ratios


def _doubt_time(sketch: Sketch) -> str | None:
    """Rates, and lengths of motions, that no arm's recording has."""
    ratios = _slope_ratios(sketch, sketch.velocity)
    if (np.abs(ratios - 1.0) < AGREEMENT).any():
        return None  # the recorded velocity vouches for the clock
    interval, moving = sketch.interval, (sketch.span > LEAST_SWEEP) & (sketch.top_speed > 0.0)
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
        return _doubt(f"q{joint + 1}", f"whole numbers up to {sketch.reach[joint]:.0f}, as counts of an encoder are")
    revolute = np.array([kind is JointType.REVOLUTE for kind in types])
    for kind, unit, factor in ((revolute, "deg", np.pi / 180.0), (~revolute, "mm", 1e-3)):
        found = _find_beyond_limits(sketch, kind, factor, robot)
        if found is not None:
            return _doubt(f"q{found[0] + 1}", found[1], f"q={unit}")
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
    limits = [joint.limits.position for joint in robot.joints] if robot else []
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
    angle = np.concatenate([window.position[1:-1, joint] for window in sketch.windows])
    slope, torque = sketch.slope[:, joint], sketch.effort_at_slope[:, joint]
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


# Multiple of a joint's torque limit that a peak stays below: limits are of the drive, or of continuous duty.
ABOVE_LIMITS = 5.0
# Multiple of the stated masses' gravity that no torque is: masses that are guessed are off by a few times.
ABOVE_GRAVITY = 20.0
LIVELY = 5.0  # acceleration of the hand, relative to gravity's, from which a motion says nothing about gravity
AS_GRAVITY = 0.8  # least cosine between torque and gravity's torque for which one is the other times a constant
POSTURES = 400

SMALL_STEP = 1e-5  # of a difference quotient: its error of 1e-10 of the slope is as large as round-off [rad or m]
LARGEST_TORQUE = 1e6  # no joint's torque is larger [Nm or N]
# A negative number that is read without its sign is at least this: signs are in bit 10 of old servos, or in bit 15.
REGISTER_RANGE = 1 << 10
# Torque in whole Nm belongs to an arm whose wrist, too, has this much; a register has it at every joint [Nm].
REGISTER_LEVEL = 30.0
MASS_DENSITY = 150.0  # mass of the heaviest arms by the cube of their reach [kg/m³]: 4,700 kg at 3.2 m
WRIST_SHARE = 0.03  # torque at the wrist of such an arm, relative to gravity's at its base
NEAR_ZERO = 0.05  # share of its 99th percentile below which a torque is near zero
FEWEST_TOUCHES = 3  # times that a magnitude comes down to zero while the joint is fast, and goes up again


def find_implausible_torque(recording: Recording, sketch: Sketch, robot: Robot | None) -> str | None:
    """The column, evidence and remedy of torque that can hardly be torque; None where it can."""
    if recording.effort_kind is EffortKind.COMMAND:
        return None
    if robot is not None and recording.effort_kind is EffortKind.CURRENT:
        for number, joint in enumerate(robot.joints, 1):
            if not joint.has_torque_constant and joint.torque_constant == 1.0:
                return (
                    f"column i{number}: holds current or drive units, and robot {robot.name} states no torque_constant"
                    f" for joint {number} ({joint.name}); state joints[{number - 1}].torque_constant, Nm per recorded"
                    " unit"
                )
    return (
        _find_register(recording, sketch, robot)
        or _find_magnitude(recording, sketch)
        or _find_excess(recording, sketch, robot)
    )


def _find_register(recording: Recording, sketch: Sketch, robot: Robot | None) -> str | None:
    """Whole numbers that are too large for an arm of this size, or that lost their sign."""
    effort, known = sketch.effort, np.isfinite(sketch.effort)
    if not known.any() or not (effort[known] == np.rint(effort[known])).all():
        return None
    name = recording.effort_kind.value
    highest = np.where(known, effort, 0.0).max(axis=0)
    if effort[known].min() >= 0.0 and highest.max() >= REGISTER_RANGE:
        joint = int(np.argmax(highest))
        return (
            f"column {name}{joint + 1}: whole numbers up to {highest[joint]:.0f} and none below zero at any joint, as a"
            " register has that is read without its sign; write signed numbers"
        )
    if recording.effort_kind is EffortKind.CURRENT:
        return None
    reach = 3.2 if robot is None else _reach(robot, sketch)
    least = max(REGISTER_LEVEL, WRIST_SHARE * MASS_DENSITY * 9.81 * reach**4)
    if percentile(np.abs(effort), 95.0)[known.any(axis=0)].min() < least:
        return None
    return (
        f"column {name}1: whole numbers of up to {np.nanmax(np.abs(effort)):.0f} at every joint, as a drive's register"
        " has; read it with --units tau=drive and state torque_constant, Nm per unit, in the robot file"
    )


def _find_magnitude(recording: Recording, sketch: Sketch) -> str | None:
    """Torque that is negative at no joint although they move both ways: friction alone must change its sign.

    Gravity may outweigh friction, but not where the torque comes down to zero at speed, both ways, and turns there.
    """
    if np.nanmin(sketch.effort, initial=0.0) < 0.0:
        return None
    for joint in range(recording.joint_count):
        effort, slope = sketch.effort_at_slope[:, joint], sketch.slope[:, joint]
        known = np.isfinite(effort) & np.isfinite(slope)
        effort, slope = effort[known], slope[known]
        if len(effort) < 100:
            continue
        top, fast = float(np.percentile(effort, 99.0)), float(np.percentile(np.abs(slope), 95.0))
        forward, backward = (float(np.mean(sign * slope > 0.3 * fast)) for sign in (1.0, -1.0))
        if top <= 0.0 or fast <= 0.0 or min(forward, backward) < 0.05:
            continue
        touches = (effort < NEAR_ZERO * top) & (effort > 0.0)  # zero itself is a dropout
        ways = [touches & (sign * slope > 0.2 * fast) for sign in (1.0, -1.0)]
        episodes = sum(int(np.count_nonzero(np.diff(way.astype(np.int8), prepend=0) == 1)) for way in ways)
        if episodes >= FEWEST_TOUCHES and ways[0].any() and ways[1].any():
            column = f"{recording.effort_kind.value}{joint + 1}"
            return (
                f"column {column}: never negative, though joint {joint + 1} moves both ways and its torque comes down"
                f" to zero {episodes} times at speed: this is a magnitude; record torque with its sign"
            )
    return None


def _find_excess(recording: Recording, sketch: Sketch, robot: Robot | None) -> str | None:
    unit, column, torque = "in Nm", recording.effort_kind.value, sketch.effort
    mend = "read current with --units tau=mA (or tau=A), and state torque_constant in the robot file"
    if recording.effort_kind is EffortKind.CURRENT:
        if robot is None:
            return None
        torque = recording.joint_torque(torque, robot)
        unit, mend = "in that unit", "read it with --units tau=mA, or correct torque_constant in the robot file"
    peak = percentile(np.abs(torque), 99.0)
    if peak.max() > LARGEST_TORQUE:
        return f"column {column}{np.argmax(peak) + 1}: {peak.max():.3g} is no joint's torque in Nm; {mend}"
    if robot is None:
        return None
    ratio = _gravity_ratio(sketch, torque, robot)
    if ratio is not None and ratio[1] > ABOVE_GRAVITY:
        joint, times = ratio
        return f"column {column}{joint + 1}: {times:.3g} times the gravity of the stated masses: hardly {unit}; {mend}"
    limits = np.array([joint.limits.torque or np.inf for joint in robot.joints])
    if ratio is not None or len(set(limits)) == 1 < len(limits):
        return None  # masses vouch for the unit; one limit for all joints is a default of a drawing program
    above = peak > ABOVE_LIMITS * limits
    if above.any() and above.sum() >= np.isfinite(limits).sum() / 2.0:
        joint = int(np.argmax(peak / limits))
        return f"column {column}{joint + 1}: {peak[joint]:.4g} Nm, of a joint limited to {limits[joint]:.4g} Nm; {mend}"
    return None


def _gravity_ratio(sketch: Sketch, torque: Array, robot: Robot) -> tuple[int, float] | None:
    """A joint whose torque follows gravity's, and how many times that it is; None where none does."""
    if robot.model.links is None or _is_lively(sketch, robot):
        return None
    known = np.flatnonzero(np.isfinite(sketch.position).all(axis=1) & np.isfinite(torque).all(axis=1))
    if len(known) < 10:
        return None
    rows = known[np.linspace(0, len(known) - 1, min(POSTURES, len(known))).astype(int)]
    gravity, effort = _gravity_torque(robot, sketch.position[rows]), torque[rows]
    weight = np.sqrt(np.mean(gravity**2, axis=0))
    size = np.sqrt(np.mean(effort**2, axis=0))
    cosine = np.mean(gravity * effort, axis=0) / np.maximum(weight * size, 1e-300)
    follows = (np.abs(cosine) > AS_GRAVITY) & (weight > 0.1 * weight.max()) & (weight > 0.0)
    if not follows.any():
        return None
    joint = int(np.argmax(np.where(follows, weight, -1.0)))
    return joint, float(size[joint] / weight[joint])


def _is_lively(sketch: Sketch, robot: Robot) -> bool:
    """Whether inertia outweighs gravity, as in fast motion: then torque that follows gravity's may be larger."""
    speed = percentile(np.abs(sketch.slope), 99.0)
    acceleration = 2.0 * speed**2 / np.maximum(sketch.span, 1e-9)  # of a wave of this speed and span
    revolute = np.array([joint.type is JointType.REVOLUTE for joint in robot.joints])
    lever = np.where(revolute, _reach(robot, sketch), 1.0)
    return bool((acceleration * lever).max() > LIVELY * 9.81)


def _gravity_torque(robot: Robot, position: Array) -> Array:
    """Torque that holds the stated masses against gravity, (N, n) [Nm or N]: the slope of their potential energy."""
    mass = np.array([link.mass for link in robot.model.links or ()])
    moment = np.array([link.first_moment for link in robot.model.links or ()])

    def potential(posture: Array) -> Array:
        frames = link_placements(robot, posture)
        centre = frames[..., :3, 3] * mass[:, None] + np.einsum("tjab,jb->tja", frames[..., :3, :3], moment)
        return -centre.sum(axis=1) @ robot.gravity

    steps = SMALL_STEP * np.eye(robot.joint_count)
    return np.stack([potential(position + step) - potential(position - step) for step in steps], 1) / (2 * SMALL_STEP)


def _reach(robot: Robot, sketch: Sketch) -> float:
    """Length of the chain at one of the recorded postures, joint by joint [m]."""
    known = np.flatnonzero(np.isfinite(sketch.position).all(axis=1))
    posture = sketch.position[known[:1]] if len(known) else np.zeros((1, robot.joint_count))
    origin = np.concatenate([np.zeros((1, 3)), link_placements(robot, posture)[0, :, :3, 3]])
    return float(np.linalg.norm(np.diff(origin, axis=0), axis=1).sum())
