"""FIGAROH's own optimal trajectory of an arm that a JSON file describes; runs where FIGAROH and cyipopt are installed.

    python tests/benchmarks/figaroh_trajectory.py ARM.json OUT.json

`benchmark_excitation.py` writes the one and reads the other; motions in ARM.json are judged by FIGAROH's regressor too.
Nothing of Tauscope is imported, so that FIGAROH may live in an environment of its own. Its settings are its defaults
(cubic splines at 100 Hz, 200 iterations at most), with the duration, limits and friction terms of the comparison; no
collision pairs, so that only its limits bind.
"""

import json
import logging
import sys
import time
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

FREQUENCY_HZ = 100


def main() -> None:
    """Optimise, and write what came of it."""
    arm = json.loads(Path(sys.argv[1]).read_text())
    Path(sys.argv[2]).write_text(json.dumps(optimise(arm)))


def optimise(arm: dict[str, Any]) -> dict[str, Any]:
    """Seconds, condition numbers by its own regressor, and the samples of the motion."""
    pinocchio = import_module("pinocchio")
    base = import_module("figaroh.optimal.base_optimal_trajectory")
    robot = import_module("pinocchio.robot_wrapper").RobotWrapper(
        pinocchio_model(pinocchio, arm), pinocchio.GeometryModel(), pinocchio.GeometryModel()
    )
    np.random.seed(arm["seed"])  # noqa: NPY002 - FIGAROH draws from the global generator

    class Generator(base.BaseOptimalTrajectory):
        """FIGAROH's base class with settings given directly, and its own problem."""

        def __init__(self) -> None:
            self.robot, self.model = robot, robot.model
            self.active_joints = [name for name in robot.model.names if name != "universe"]
            self.logger = logging.getLogger("figaroh")
            self.trajectory_config = trajectory_settings(arm)
            self.identif_config = identification_settings(self.active_joints)
            self.results = {"T_F": [], "P_F": [], "V_F": [], "A_F": [], "iteration_data": []}

        def create_ipopt_problem(self, *arguments: Any) -> Any:
            return base.BaseTrajectoryIPOPTProblem(self, *arguments)

    generator = Generator()
    begin, begin_busy = time.perf_counter(), time.process_time()
    generator.initialize()
    generator.solve(stack_reps=1)
    seconds, busy = time.perf_counter() - begin, time.process_time() - begin_busy
    judged = {name: condition_number(generator, motion) for name, motion in arm["motions"].items()}
    if not generator.results["T_F"]:
        return {"seconds": seconds, "processor_seconds": busy, "failed": True, "judged": judged}
    position, velocity, acceleration = (np.asarray(generator.results[key][0]) for key in ("P_F", "V_F", "A_F"))
    data = generator.results["iteration_data"][0]
    return {
        "seconds": seconds,
        "processor_seconds": busy,
        "failed": False,
        "status": int(data["status"]),
        "iterations": len(data["iterations"]),
        "history": [float(value) for value in data["obj_values"]],
        "condition_number": condition_number(generator, (position, velocity, acceleration)),
        "judged": judged,
        "position": position.tolist(),
        "velocity": velocity.tolist(),
        "acceleration": acceleration.tolist(),
    }


def condition_number(generator: Any, motion: Any) -> float:
    """Condition number of FIGAROH's own base regressor: what it minimises."""
    return float(np.linalg.cond(generator._stack_base_regressors(*(np.asarray(part) for part in motion))))


def trajectory_settings(arm: dict[str, Any]) -> dict[str, Any]:
    """FIGAROH's defaults; waypoints every two seconds."""
    interval_s = 2.0
    return {
        "n_wps": round(arm["duration_s"] / interval_s) + 1,
        "freq": FREQUENCY_HZ,
        "t_s": interval_s,
        "soft_lim": 0.0,
        "max_attempts": 1000,
        "max_iterations": arm["max_iterations"],
        "segment_attempts": 1,
    }


def identification_settings(names: list[str]) -> dict[str, Any]:
    """Base parameters with viscous and Coulomb friction and an offset, no rotors."""
    joints = len(names)
    return {
        "has_friction": True,
        "has_actuator_inertia": False,
        "has_joint_offset": True,
        "is_joint_torques": True,
        "is_external_wrench": False,
        "force_torque": None,
        "has_coupled_wrist": False,
        "act_Jid": list(range(1, joints + 1)),
        "act_idxv": list(range(joints)),
        "active_joints": names,
        "idx_act_joints": list(range(joints)),
        "fv": [0.0] * joints,
        "fs": [0.0] * joints,
        "off": [0.0] * joints,
        "Ia": [0.0] * joints,
    }


def pinocchio_model(pinocchio: Any, arm: dict[str, Any]) -> Any:
    """The chain of revolute joints, its links and its limits."""
    model = pinocchio.Model()
    model.gravity = pinocchio.Motion(np.array(arm["gravity"]), np.zeros(3))
    joint, previous = 0, pinocchio.SE3.Identity()
    for index, entry in enumerate(arm["joints"]):
        low, high = entry["position"]
        before, after = (
            pinocchio.SE3(np.array(entry[side]["rotation"]), np.array(entry[side]["translation"]))
            for side in ("before", "after")
        )
        joint = model.addJoint(
            joint,
            pinocchio.JointModelRZ(),
            previous * before,
            f"joint{index + 1}",
            np.array([entry["torque"]]),
            np.array([entry["velocity"]]),
            np.array([low]),
            np.array([high]),
        )
        parameters = np.array(entry["parameters"])[[6, 7, 8, 9, 0, 3, 1, 4, 5, 2]]
        if parameters[0] > 0.0:  # Pinocchio makes NaN of a link without mass, as the paper's arm has one
            model.appendBodyToJoint(joint, pinocchio.Inertia.FromDynamicParameters(parameters), after)
        previous = after
    return model


if __name__ == "__main__":
    main()
