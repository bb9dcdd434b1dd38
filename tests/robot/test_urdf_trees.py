"""Whole trees against Pinocchio: side branches, locked joints and mimic joints, in torque to 1e-9.

Pinocchio moves every joint of the tree. The joints that rest stand still there, those that follow move as
q = m q_master + b, and the torque of a master is Σ m τ over what follows it.
"""

from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pinocchio  # pyright: ignore[reportMissingImports]
from hypothesis import given, settings
from hypothesis import strategies as st

from tauscope.dynamics import inverse_dynamics, mass_matrix, torque_regressor
from tauscope.dynamics.regressor import TorqueRegressor
from tauscope.dynamics.regressor_gradient import RegressorGradient
from tauscope.robot import Robot, read_robot, robot_from_dict, robot_to_dict

MOVING = ("revolute", "continuous", "prismatic")


@dataclass
class Tree:
    """A random URDF as text, its chain, and what its joints do."""

    rng: np.random.Generator
    text: list[str] = field(default_factory=list)
    kinds: dict[str, str] = field(default_factory=dict)
    mimics: dict[str, tuple[str, float, float]] = field(default_factory=dict)
    links: int = 0

    def link(self) -> str:
        self.links += 1
        cloud = self.rng.normal(0.0, 0.1, (6, 3))
        inertia = 0.3 * (np.sum(cloud**2) * np.eye(3) - cloud.T @ cloud)
        places = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
        values = " ".join(f'{key}="{float(inertia[at])!r}"' for key, at in places.items())
        name = f"link {self.links}"  # a name with a space
        body = f"<inertial>{self.origin()}<mass value='{self.rng.uniform(0.1, 5.0)}'/><inertia {values}/></inertial>"
        self.text.append(f"<link name='{name}'>{body}</link>")
        return name

    def origin(self) -> str:
        xyz, rpy = (" ".join(str(v) for v in self.rng.uniform(-s, s, 3)) for s in (0.5, 3.0))
        return f"<origin xyz='{xyz}' rpy='{rpy}'/>"

    def joint(self, kind: str, parent: str, mimic: tuple[str, float, float] | None = None) -> str:
        """A joint and its child link, whose name it gives."""
        child, name = self.link(), f"joint {len(self.kinds) + 1}"
        self.kinds[name] = kind
        follow = ""
        if mimic is not None:
            self.mimics[name] = mimic
            follow = f"<mimic joint='{mimic[0]}' multiplier='{mimic[1]!r}' offset='{mimic[2]!r}'/>"
        axis = " ".join(str(value) for value in self.rng.normal(size=3))
        self.text.append(
            f"<joint name='{name}' type='{kind}'>{self.origin()}<parent link='{parent}'/><child link='{child}'/>"
            f"<axis xyz='{axis}'/><limit lower='-3' upper='3' velocity='2' effort='50'/>{follow}</joint>"
        )
        return child

    @property
    def last(self) -> str:
        return list(self.kinds)[-1]

    def document(self) -> str:
        return "<robot name='random'>" + "".join(self.text) + "</robot>"


@dataclass
class Case:
    tree: Tree
    robot: Robot
    locked: dict[str, float]
    own: list[str]

    def position(self, name: str, q: dict[str, float], rate: bool) -> float:
        """Position of any joint, or its rate where the masters' rates are given."""
        if name in self.locked:
            return 0.0 if rate else self.locked[name]
        if name in self.tree.mimics:
            master, ratio, offset = self.tree.mimics[name]
            return ratio * self.position(master, q, rate) + (0.0 if rate else offset)
        return q.get(name, 0.0)


def make_case(seed: int, steps: int) -> Case:
    """A chain of free, locked, fixed and mimic joints, with moving and fixed branches beside it."""
    rng = np.random.default_rng(seed)
    tree = Tree(rng)
    base = end = tree.link()
    locked: dict[str, float] = {}
    own: list[str] = []
    branches: list[str] = []
    for step in range(steps):
        kind = str(rng.choice(MOVING))
        role = "free" if step == 0 else str(rng.choice(["free", "free", "fixed", "locked", "mimic"]))
        if role == "fixed":
            end = tree.joint("fixed", end)
        elif role == "mimic":
            master = str(rng.choice(own))
            end = tree.joint(kind, end, (master, float(rng.uniform(-2, 2)), float(rng.uniform(-1, 1))))
        else:
            end = tree.joint(kind, end)
            if role == "locked":
                locked[tree.last] = float(rng.uniform(-1, 1))
            else:
                own.append(tree.last)
        side = end
        for _ in range(rng.integers(0, 3)):
            choice = rng.uniform()
            mimic = (str(rng.choice(branches)), 0.7, 0.1) if branches and choice < 0.3 else None
            side = tree.joint(str(rng.choice([*MOVING, "fixed"])) if mimic is None else "revolute", side, mimic)
            if tree.kinds[tree.last] != "fixed" and mimic is None:
                branches.append(tree.last)
                if choice > 0.6:
                    locked[tree.last] = float(rng.uniform(-1, 1))
    stated = ", ".join(f"{name!r}: {value!r}" for name, value in locked.items())
    text = f"name: a\nkinematics: {{urdf: {{file: a.urdf, base: {base!r}, tip: {end!r}}}}}\nlocked: {{{stated}}}\n"
    with TemporaryDirectory() as folder:
        (Path(folder) / "a.yaml").write_text(text)
        (Path(folder) / "a.urdf").write_text(tree.document())
        robot = read_robot(Path(folder) / "a.yaml")
    return Case(tree, robot, locked, own)


def pinocchio_torque(case: Case, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
    """Torque of the chain's own joints at one sample."""
    model = pinocchio.buildModelFromXML(case.tree.document())
    names = [name for name in case.tree.kinds if case.tree.kinds[name] != "fixed"]
    states = [dict(zip(case.own, values, strict=True)) for values in (q, qd, qdd)]
    configuration, rates = np.zeros(model.nq), np.zeros((2, model.nv))
    for name in names:
        joint = model.joints[model.getJointId(name)]
        position = case.position(name, states[0], False)
        if joint.nq == 2:
            configuration[joint.idx_q : joint.idx_q + 2] = np.cos(position), np.sin(position)
        else:
            configuration[joint.idx_q] = position
        rates[:, joint.idx_v] = [case.position(name, state, True) for state in states[1:]]
    torque = pinocchio.rnea(model, model.createData(), configuration, *rates)
    total = np.zeros(len(case.own))
    for name in names:
        index = model.joints[model.getJointId(name)].idx_v
        for place, master in enumerate(case.own):
            total[place] += case.position(name, {master: 1.0}, True) * torque[index]
    return total


@given(seed=st.integers(0, 2**32 - 1), steps=st.integers(1, 8))
def test_torque_of_a_tree_is_pinocchios(seed: int, steps: int) -> None:
    case = make_case(seed, steps)
    robot, rng = case.robot, np.random.default_rng(seed)
    assert [joint.name for joint in robot.joints] == case.own
    q, qd, qdd = (rng.uniform(-2.0, 2.0, (3, robot.joint_count)) for _ in range(3))
    assert robot.model.links is not None
    parameters = np.concatenate([link.to_vector() for link in robot.model.links])
    expected = np.array([pinocchio_torque(case, *state) for state in zip(q, qd, qdd, strict=True)])
    torque = inverse_dynamics(robot, parameters, q, qd, qdd)
    np.testing.assert_allclose(torque, expected, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(torque_regressor(robot, q, qd, qdd) @ parameters, expected, rtol=1e-9, atol=1e-9)
    zero = np.zeros_like(q)
    inertial = inverse_dynamics(robot, parameters, q, zero, qdd) - inverse_dynamics(robot, parameters, q, zero, zero)
    moved = np.einsum("nij,nj->ni", mass_matrix(robot, parameters, q), qdd)
    np.testing.assert_allclose(moved, inertial, rtol=1e-9, atol=1e-9)
    again = robot_from_dict(robot_to_dict(robot))
    np.testing.assert_array_equal(inverse_dynamics(again, parameters, q, qd, qdd), torque)


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1))
def test_gradient_of_a_coupled_regressor_is_that_of_differences(seed: int) -> None:
    robot, rng = make_case(seed, 6).robot, np.random.default_rng(seed)
    states = [rng.uniform(-2.0, 2.0, (2, robot.joint_count)) for _ in range(3)]
    columns = 10 * robot.link_count
    weight = rng.normal(size=(robot.joint_count, columns, 2))

    def value(parts: list[np.ndarray]) -> np.ndarray:
        out = np.empty((robot.joint_count, columns, 2))
        TorqueRegressor(robot, chunk=2).write(parts[0], parts[1], parts[2], out)
        return np.einsum("jcn,jcn->n", weight, out)

    gradients = RegressorGradient(robot, capacity=2).contract(states[0], states[1], states[2], weight)
    step = 1e-6
    for part, gradient in enumerate(gradients):
        for joint in range(robot.joint_count):
            moved = [np.array(state) for state in states]
            moved[part][:, joint] += step
            above = value(moved)
            moved[part][:, joint] -= 2 * step
            slope = (above - value(moved)) / (2 * step)
            np.testing.assert_allclose(gradient[:, joint], slope, rtol=1e-5, atol=1e-5 * np.abs(slope).max() + 1e-5)
