"""The chain between two bodies of an MJCF, as MuJoCo compiles it.

Includes, defaults, classes, frames and inertias from shapes are MuJoCo's own work; what is read here is the compiled
model. Link frames are MuJoCo's body frames. A hinge or slide is ``before · motion along z | after`` with the joint's
anchor and axis between the two placements; a body with several joints has a massless link for each but the last.
Bodies without a joint, and bodies on joints that rest, belong to the link that carries them.
"""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's extension modules come without type stubs)

import warnings
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from tauscope.errors import RobotFileError, one_line
from tauscope.robot.actuator import Actuator
from tauscope.robot.chain import Chain, ChainMotion, Master, ResultWarning, default_ends_note, rigid_branch_note
from tauscope.robot.document import MOST_JOINTS
from tauscope.robot.kinematics import compose, joint_displacement, rotation_of_z_to
from tauscope.robot.messages import Finding, Severity, nearest, shown
from tauscope.robot.robot import Array, FrictionCoefficients, JointLimits, JointType, LinkInertia, Placement, Segment
from tauscope.robot.urdf_xml import inertia_about_frame
from tauscope_sim.mujoco_log import list_actuators

HINGE, SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)
CHOSEN_STD = 0.2  # relative standard error of an MJCF's gains: most are chosen so that the arm looks right

MOTOR, LOOP = int(mujoco.mjtBias.mjBIAS_NONE), int(mujoco.mjtBias.mjBIAS_AFFINE)  # what actuators add by themselves
_ALONG_Z = np.array([0.0, 0.0, 1.0])


def read_chain(
    data: bytes, label: str, path: Path | None, base: str | None, tip: str | None, locked: Mapping[str, float]
) -> Chain:
    """The chain from body `base` to body `tip`; by default from the root to the deepest body.

    Raises RobotFileError without such a chain. `path`: of the file, None for text alone; `locked`: position of joints
    that rest.
    """
    return _Reader(_compile(data, label, path), label, locked).chain(base, tip)


@dataclass(frozen=True)
class _Joint:
    """A joint of the compiled model by its index, and what it follows."""

    index: int
    name: str
    kind: int
    body: int
    rest: float  # its position as the file states the arm [rad or m]
    master: Master | None

    @property
    def moves(self) -> bool:
        return self.kind in (HINGE, SLIDE)

    @property
    def type(self) -> JointType:
        return JointType.PRISMATIC if self.kind == SLIDE else JointType.REVOLUTE


class _Reader:
    def __init__(self, model: mujoco.MjModel, label: str, locked: Mapping[str, float]) -> None:
        self._model, self._label, self._locked = model, label, locked
        self._data = mujoco.MjData(model)
        mujoco.mj_forward(model, self._data)
        self._findings: list[Finding] = []
        self._body_names = [model.body(index).name or f"body {index}" for index in range(model.nbody)]
        self._joints: list[_Joint] = []
        for index, body in enumerate(map(int, model.jnt_bodyid)):
            number = index - int(model.body_jntadr[body])
            name = model.joint(index).name or f"{self._body_names[body]}_joint{number + 1 if number else ''}"
            rest = float(model.qpos0[model.jnt_qposadr[index]])
            self._joints.append(_Joint(index, name, int(model.jnt_type[index]), body, rest, None))
        self._find_masters()
        self._by_name = {joint.name: joint for joint in self._joints}
        for name in locked:
            if name not in self._by_name:
                raise self._error(f"locked: joint {shown(name)} is not in the file; {nearest(name, self._by_name)}")

    def chain(self, base: str | None, tip: str | None) -> Chain:
        first, last = self._ends(base, tip)
        bodies = self._path(first, last)
        path = [joint for body in bodies for joint in self._joints_of(body)]
        free = [joint for joint in path if joint.name not in self._locked]
        for joint in free:
            if not joint.moves:
                raise self._error(f"joint {shown(joint.name)} is a ball or free joint; name the body beyond it as base")
        motion = ChainMotion({joint.name: joint.master for joint in free})
        moving = [joint for joint in free if joint.name in motion.moving]
        if not moving:
            names = f"base {shown(self._body_names[first])} and tip {shown(self._body_names[last])}"
            has_none = not any(joint.moves for joint in self._joints)
            remedy = "give the file of the whole arm" if has_none else "name the last body as tip"
            raise self._error(f"no hinge or slide lies between {names}; {remedy}")
        names, independent = motion.independent, [self._by_name[name] for name in motion.independent]
        segments, members = self._segments(bodies, moving, motion)
        links = tuple(self._link(placed) for _, placed in members)
        notes = [self._branches(members, moving)]
        if base is None or tip is None:
            ends = self._body_names[first], self._body_names[last]
            notes.insert(0, default_ends_note(self._label, "mjcf", *ends, names))
        self._remark_on_the_rest()
        rotors = [self._rotor_inertia(joint) for joint in independent]
        return Chain(
            base=self._body_names[first],
            tip=self._body_names[last],
            joint_names=names,
            segment_names=tuple(joint.name for joint in moving),
            joint_types=tuple(joint.type for joint in independent),
            segments=segments,
            limits=tuple(self._limits(joint) for joint in independent),
            links=links if any(link.mass for link in links) else None,
            friction=self._friction(moving, motion),
            rotor_inertia=tuple(rotors) if any(rotors) else None,
            link_names=tuple(tuple(self._body_names[each] for each, _, _ in placed) for _, placed in members),
            branches=tuple(self._link([each for each in placed if each[0] != body]) for body, placed in members),
            actuators=tuple(self._actuator(joint) for joint in independent),
            findings=tuple(self._findings),
            repairs=(),
            notes=tuple(note for note in notes if note is not None),
            gravity=self._gravity(first),
        )

    def _error(self, text: str) -> RobotFileError:
        return RobotFileError(f"{self._label}: {text}")

    def _remark(self, severity: Severity, joint: _Joint, text: str) -> None:
        self._findings.append(Finding(severity, one_line(f"{self._label}: joint {shown(joint.name)}"), text))

    def _gravity(self, base: int) -> Array:
        if self._model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_GRAVITY):
            return np.zeros(3)
        return self._data.xmat[base].reshape(3, 3).T @ self._model.opt.gravity

    def _remark_on_the_rest(self) -> None:
        model, left = self._model, []
        if model.opt.density or model.opt.viscosity:
            left.append("drag of the medium (option density, viscosity)")
        if any(model.tendon_stiffness) or np.any(model.tendon_damping) or any(model.tendon_frictionloss):
            left.append("stiffness, damping and friction of tendons")
        if np.any(model.body_gravcomp):
            left.append("gravity compensation (gravcomp)")
        self._findings += [Finding(Severity.WARNING, self._label, f"the model leaves out {each}") for each in left]

    def _find_masters(self) -> None:
        """Joints tied to another by an equality that is linear: q₁ - q₁⁰ = c₀ + c₁ (q₂ - q₂⁰)."""
        model = self._model
        for index in np.flatnonzero(model.eq_type == int(mujoco.mjtEq.mjEQ_JOINT)):
            first, second = int(model.eq_obj1id[index]), int(model.eq_obj2id[index])
            offset, ratio, *higher = (float(value) for value in model.eq_data[index][:5])
            if second < 0 or any(higher) or not ratio or not model.eq_active0[index]:
                continue
            own, other = self._joints[first], self._joints[second]
            master = Master(other.name, ratio, own.rest + offset - ratio * other.rest)
            self._joints[first] = replace(own, master=master)

    def _ends(self, base: str | None, tip: str | None) -> tuple[int, int]:
        """Bodies of base and tip: the world, or the first one below a free joint, and the body with most joints."""
        found: dict[str, int] = {}
        for role, name in (("base", base), ("tip", tip)):
            if name is None:
                continue
            if name not in self._body_names:
                hint = nearest(name, self._body_names)
                raise self._error(f"the {role} body {shown(name)} is not in the file; {hint}")
            found[role] = self._body_names.index(name)
        if "tip" not in found:

            def depth(body: int) -> tuple[int, int]:
                above = self._above(body, found.get("base"))
                joints = [joint for each in above for joint in self._joints_of(each)]
                own = [joint for joint in joints if joint.master is None and joint.name not in self._locked]
                return len([joint for joint in own if joint.moves]), len(above)

            parents = set(map(int, self._model.body_parentid[1:]))
            found["tip"] = max((body for body in range(self._model.nbody) if body not in parents), key=depth, default=0)
        if "base" not in found:
            above = self._above(found["tip"], None)
            found["base"] = int(self._model.body_parentid[above[0]]) if above else found["tip"]
            first = above[0] if above else 0
            if not all(joint.moves for joint in self._joints_of(first)):
                found["base"] = first
        return found["base"], found["tip"]

    def _above(self, body: int, base: int | None) -> list[int]:
        """Bodies from below the base, or from the last one on a free or ball joint, to a body; the upper first."""
        chain: list[int] = []
        while body and body != base:
            chain.append(body)
            if base is None and not all(joint.moves for joint in self._joints_of(body)):
                break
            body = int(self._model.body_parentid[body])
        return chain[::-1] if base is None or body == base else []

    def _path(self, base: int, tip: int) -> list[int]:
        path = self._above(tip, base)
        if not path and tip != base:
            names = shown(self._body_names[tip]), shown(self._body_names[base])
            raise self._error(f"the tip {names[0]} does not hang on the base {names[1]}; name bodies of one chain")
        if len(path) > MOST_JOINTS:
            raise self._error(f"the chain has {len(path)} bodies, more than {MOST_JOINTS}")
        return path

    def _joints_of(self, body: int) -> list[_Joint]:
        first, count = int(self._model.body_jntadr[body]), int(self._model.body_jntnum[body])
        return self._joints[first : first + count] if count else []

    def _segments(
        self, path: list[int], moving: list[_Joint], motion: ChainMotion
    ) -> tuple[tuple[Segment, ...], list[tuple[int, list[tuple[int, Placement, bool]]]]]:
        """Segments, and for each the body whose frame its link has, with the bodies that belong to it."""
        segments: list[Segment] = []
        members: list[tuple[int, list[tuple[int, Placement, bool]]]] = []
        pending = Placement()
        for body in path:
            pending = compose(pending, self._placement(body))
            joints = self._joints_of(body)
            for joint in joints:
                if joint not in moving:
                    pending = compose(pending, self._rigid_motion(joint))
                    continue
                anchor = Placement(translation=np.array(self._model.jnt_pos[joint.index]))
                align = Placement(rotation_of_z_to(np.array(self._model.jnt_axis[joint.index])))
                turned = joint_displacement(joint.type, _ALONG_Z, -joint.rest)
                before = compose(compose(pending, anchor), compose(align, turned))
                after = compose(Placement(align.rotation.T), Placement(translation=-anchor.translation))
                segments.append(Segment(joint.type, before, after, motion.couplings[joint.name]))
                members.append((body, []))
                pending = Placement()
            if members and members[-1][0] == body:
                members[-1] = (body, list(self._find_carried(body, moving)))
        return tuple(segments), members

    def _find_carried(self, body: int, moving: list[_Joint]) -> Iterable[tuple[int, Placement, bool]]:
        """Bodies that move with a body, where each is in its frame, and whether a joint that rests carries it."""
        stops = {joint.body for joint in moving}
        waiting = [(body, Placement(), False)]
        while waiting:
            each, placement, on_joint = waiting.pop()
            yield each, placement, on_joint
            for below in map(int, np.flatnonzero(self._model.body_parentid == each)):
                if below in stops or not below:
                    continue
                joints = self._joints_of(below)
                at = compose(placement, self._placement(below))
                for joint in joints:
                    at = compose(at, self._rigid_motion(joint))
                waiting.append((below, at, on_joint or bool(joints)))

    def _placement(self, body: int) -> Placement:
        return Placement(_rotation(self._model.body_quat[body]), np.array(self._model.body_pos[body]))

    def _rigid_position(self, joint: _Joint) -> float:
        """Position of a joint that rests: locked, following a joint that rests, or at its reference [rad or m]."""
        if joint.name in self._locked:
            return self._locked[joint.name]
        if joint.master is None or joint.master.joint not in self._locked:
            return joint.rest
        return joint.master.multiplier * self._locked[joint.master.joint] + joint.master.offset

    def _rigid_motion(self, joint: _Joint) -> Placement:
        if not joint.moves:
            return Placement()
        anchor, axis = (np.array(of[joint.index]) for of in (self._model.jnt_pos, self._model.jnt_axis))
        moved = joint_displacement(joint.type, axis, self._rigid_position(joint) - joint.rest)
        return compose(Placement(translation=anchor), compose(moved, Placement(translation=-anchor)))

    def _link(self, members: Iterable[tuple[int, Placement, bool]]) -> LinkInertia:
        model, total = self._model, np.zeros(10)
        for each, placement, _ in members:
            centre = Placement(_rotation(model.body_iquat[each]), np.array(model.body_ipos[each]))
            inertia = np.diag(model.body_inertia[each])
            link = inertia_about_frame(float(model.body_mass[each]), compose(placement, centre), inertia)
            total += link.to_vector()
        return LinkInertia.from_vector(total)

    def _branches(
        self, members: list[tuple[int, list[tuple[int, Placement, bool]]]], moving: list[_Joint]
    ) -> ResultWarning | None:
        names, following, mass = [], [], 0.0
        chain = {joint.name for joint in moving}
        carried = [body for _, placed in members for body, _, on_joint in placed if on_joint]
        for body in carried:
            joints = [each for each in self._joints_of(body) if each.name not in chain]
            masters = {each.name: each.master and each.master.joint for each in joints}
            free = [name for name, master in masters.items() if not {name, master} & set(self._locked)]
            names += free
            following += [name for name in free if masters[name] in chain]
            mass += float(self._model.body_mass[body])
        return rigid_branch_note(self._label, names, mass, following) if names and mass > 0.0 else None

    def _limits(self, joint: _Joint) -> JointLimits:
        model, index = self._model, joint.index
        low, high = (float(value) for value in model.jnt_range[index])
        torques = [abs(float(value)) for value in model.jnt_actfrcrange[index] if model.jnt_actfrclimited[index]]
        for actuator in self._actuators_of(joint):
            gear = abs(float(model.actuator_gear[actuator, 0]))
            if model.actuator_forcelimited[actuator]:
                torques.append(gear * float(np.max(np.abs(model.actuator_forcerange[actuator]))))
            elif model.actuator_biastype[actuator] == MOTOR and model.actuator_ctrllimited[actuator]:
                gain = abs(float(model.actuator_gainprm[actuator, 0]))
                torques.append(gear * gain * float(np.max(np.abs(model.actuator_ctrlrange[actuator]))))
        torque = min((value for value in torques if 0.0 < value < np.inf), default=None)
        stated = bool(model.jnt_limited[index]) and low < high
        return JointLimits(position=(low, high) if stated else None, torque=torque)

    def _friction(self, moving: list[_Joint], motion: ChainMotion) -> tuple[FrictionCoefficients, ...] | None:
        """Stiction from frictionloss, viscous from damping."""
        model, stated = self._model, {}
        for joint in moving:
            dof = int(model.jnt_dofadr[joint.index])
            damping = float(model.dof_damping[dof]) + self._reflect(joint, model.actuator_damping)
            stated[joint.name] = (float(model.dof_frictionloss[dof]), damping)
            if model.jnt_stiffness[joint.index]:
                text = f"has stiffness {float(model.jnt_stiffness[joint.index]):g}, which the model leaves out"
                self._remark(Severity.WARNING, joint, text)
            if np.any(model.dof_dampingpoly[dof]):
                self._remark(Severity.WARNING, joint, "has polynomial damping; the model takes its linear part")
        return motion.friction(stated) if any(map(any, stated.values())) else None

    def _rotor_inertia(self, joint: _Joint) -> float:
        """Armature of a joint, and of its actuators times gear² [kg m² or kg]."""
        own = float(self._model.dof_armature[self._model.jnt_dofadr[joint.index]])
        return own + self._reflect(joint, self._model.actuator_armature)

    def _actuators_of(self, joint: _Joint) -> list[int]:
        return list_actuators(self._model, joint.index)

    def _reflect(self, joint: _Joint, values: Array) -> float:
        """Sum over a joint's actuators of a value times gear²."""
        gears = self._model.actuator_gear[:, 0]
        return sum(float(values[index]) * float(gears[index]) ** 2 for index in self._actuators_of(joint))

    def _actuator(self, joint: _Joint) -> Actuator | None:
        """Gains of a joint's actuator in joint units; of several the first that holds the position."""
        model, found = self._model, None
        for index in self._actuators_of(joint):
            gear = float(model.actuator_gear[index, 0])
            if model.actuator_biastype[index] != LOOP:
                found = found or Actuator("torque")
                continue
            kp, kv = -float(model.actuator_biasprm[index, 1]), -float(model.actuator_biasprm[index, 2])
            kp, kv = kp * gear * gear + 0.0, kv * gear * gear + 0.0  # no negative zero
            loop = Actuator("position", kp, kv) if kp else Actuator("velocity", kv)
            actuator = replace(loop, scale_std=CHOSEN_STD)
            if found is None or found.kind != "position":
                found = actuator
        if found is not None and found.kind != "torque":
            gains = (found.kp, found.kd) if found.kind == "position" else (0.0, found.kp)
            text = f"a {found.kind} actuator drives it, kp {gains[0]:g}, kv {gains[1]:g} in joint units"
            self._remark(Severity.INFO, joint, text)
        return found


def _rotation(quaternion: Array) -> Array:
    return Rotation.from_quat(quaternion, scalar_first=True).as_matrix()


def _compile(data: bytes, label: str, path: Path | None) -> mujoco.MjModel:
    """The compiled model, without shapes whose files are missing. Raises RobotFileError. `path`: of the file."""
    try:
        with warnings.catch_warnings(action="ignore"):  # attributes that MuJoCo will remove one day
            with suppress(ValueError):
                return _parse(data, path).compile()
            spec = _parse(data, path)
            _drop_shapes(spec)
            return spec.compile()
    except ValueError as error:
        reason = " ".join(str(error).split()).removeprefix("Error: ")
        remedy = "correct it"
        if "opening file" in reason:
            remedy = "put that file there" + ("" if "include" in reason else ", or state <inertial> of every body")
        raise RobotFileError(f"{label}: MuJoCo refuses the file ({reason}); {remedy}") from None


def _parse(data: bytes, path: Path | None) -> mujoco.MjSpec:
    """The editable model; of a file, so that what it names is found beside it."""
    return mujoco.MjSpec.from_string(data.decode()) if path is None else mujoco.MjSpec.from_file(str(path))


def _drop_shapes(spec: mujoco.MjSpec) -> None:
    """Delete meshes, height fields and textures, and the shapes that need them, where none of these gives a mass."""
    if spec.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE:
        return
    for body in spec.bodies:
        weighs = any(geom.meshname and geom.mass != 0.0 for geom in body.geoms)
        if weighs and not body.explicitinertial and _moves(body):
            return
    for geom in list(spec.geoms):
        if geom.meshname or geom.hfieldname:
            spec.delete(geom)
    for geom in spec.geoms:
        geom.material = ""
    for site in spec.sites:
        site.material = ""
    for kind in (spec.skins, spec.meshes, spec.hfields, spec.materials, spec.textures):
        for element in list(kind):
            spec.delete(element)


def _moves(body: mujoco.MjsBody) -> bool:
    while body is not None:
        if body.joints:
            return True
        body = body.parent
    return False
