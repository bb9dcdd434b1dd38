"""The robot file's arm as a MuJoCo model: joints and rigid links, nothing else."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's extension modules come without type stubs)

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from tauscope.errors import RobotFileError, TauscopeError
from tauscope.robot.physical import about_centre, nearest_body
from tauscope.robot.robot import Array, JointType, LinkInertia, Robot, Segment

# added to each principal moment of inertia [kg m²]: a slender rod has a zero one, MuJoCo refuses less than 1e-15
LEAST_INERTIA = 1e-12
LEAST_MASS = 1e-12  # mass given to a massless link [kg], for the same reason

_JOINT_TYPES = {JointType.REVOLUTE: mujoco.mjtJoint.mjJNT_HINGE, JointType.PRISMATIC: mujoco.mjtJoint.mjJNT_SLIDE}


def build_spec(robot: Robot) -> mujoco.MjSpec:
    """Editable MuJoCo model of an arm: ``robot.segments`` as joints, ``robot.model.links`` as rigid bodies.

    The generalised coordinates are the positions of the segments, in chain order; what ties a segment to a joint that
    it follows is not in the model, see `tauscope_sim.plant.rigid_bodies`. There are no geometries, no
    joint limits, no damping and no actuators: what is not in the robot file is not in the model. Friction is not part
    of it either; see `tauscope_sim.friction`. Raises RobotFileError where the robot file states no links, or where
    MuJoCo refuses the model.
    """
    links = robot.model.links
    if links is None or len(links) != robot.link_count:
        stated = 0 if links is None else len(links)
        raise RobotFileError(
            f"{_origin(robot)}: model.links states {stated} of {robot.link_count} links; "
            "a simulation needs mass, first_moment and inertia of each"
        )
    spec = mujoco.MjSpec()
    spec.modelname = robot.name
    spec.compiler.degree = False
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    spec.option.gravity = robot.gravity
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    spec.option.timestep = 1e-3
    body = spec.worldbody
    with _mujoco_refusals(robot):
        rows = zip(robot.segment_labels, robot.segments, links, strict=True)
        for number, (name, segment, link) in enumerate(rows, 1):
            body = body.add_body(name=f"link{number}")
            _place(body, name, segment)
            _weigh(body, link)
    return spec


def build_model(robot: Robot) -> mujoco.MjModel:
    """Compiled model of an arm; see `build_spec`. Raises RobotFileError: no links, or MuJoCo refuses the model."""
    spec = build_spec(robot)
    with _mujoco_refusals(robot):
        return spec.compile()


@contextmanager
def _mujoco_refusals(robot: Robot) -> Iterator[None]:
    """Name the robot where MuJoCo refuses a model, in one line."""
    try:
        yield
    except TauscopeError:
        raise
    except ValueError as error:
        reason = " ".join(str(error).split()).removeprefix("Error: ")
        raise RobotFileError(f"{_origin(robot)}: MuJoCo refuses the arm ({reason}); correct the robot file") from error


def _origin(robot: Robot) -> str:
    return str(robot.source) if robot.source is not None else robot.name


def _place(body: mujoco.MjsBody, name: str, segment: Segment) -> None:
    """Put the body at ``before · after`` and its joint axis where the z axis between the two placements lies."""
    before, after = segment.before, segment.after
    body.pos = before.translation + before.rotation @ after.translation
    body.quat = _quaternion(before.rotation @ after.rotation)
    # MuJoCo states the axis in the body's own frame: x = afterᵀ (z axis, origin)
    body.add_joint(
        name=name,
        type=_JOINT_TYPES[segment.type],
        axis=after.rotation.T @ np.array([0.0, 0.0, 1.0]),
        pos=-after.rotation.T @ after.translation,
        limited=mujoco.mjtLimited.mjLIMITED_FALSE,
    )


def _weigh(body: mujoco.MjsBody, link: LinkInertia) -> None:
    inertia = body_inertia(link)
    body.explicitinertial = True
    body.mass = inertia.mass
    body.ipos = inertia.centre
    body.iquat = inertia.quaternion
    body.inertia = inertia.moments


@dataclass(frozen=True, eq=False)
class BodyInertia:
    """Inertia of a body in MuJoCo's terms."""

    mass: float  # m, above zero [kg]
    centre: Array  # (3,), centre of mass in the link frame [m]
    quaternion: Array  # (4,), (w, x, y, z) of the principal axes in the link frame
    moments: Array  # (3,), principal moments about the centre of mass, ascending, above zero [kg m²]


def body_inertia(link: LinkInertia) -> BodyInertia:
    """Centre of mass, principal axes and principal moments of a link, or of the nearest body where it is none."""
    body = nearest_body(link)
    centre = body.first_moment / body.mass if body.mass > 0.0 else np.zeros(3)
    moments, axes = np.linalg.eigh(about_centre(body))
    if np.linalg.det(axes) < 0.0:
        axes[:, 0] = -axes[:, 0]
    return BodyInertia(
        mass=max(body.mass, LEAST_MASS),
        centre=centre,
        quaternion=_quaternion(axes),
        moments=_regularise(moments, float(np.trace(body.inertia))),
    )


def _regularise(moments: Array, scale: float) -> Array:
    """Ascending principal moments with rounding removed and just enough added for MuJoCo to accept them."""
    first, second, third = (max(float(moment), 0.0) for moment in moments)
    # a flat body has third = first + second: rounding may put it a hair above, which MuJoCo refuses
    first += max(0.0, third - second - first)
    return np.array([first, second, third]) + max(LEAST_INERTIA, 1e-13 * scale)


def _quaternion(rotation: Array) -> Array:
    return Rotation.from_matrix(rotation).as_quat(scalar_first=True)
