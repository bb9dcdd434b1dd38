# %% [markdown]
# # A campaign on the simulated arm
# Design a motion, record it, identify, diagnose, record the motion that the diagnosis asks for, diagnose again.

# %%
from pathlib import Path

import tauscope

robot = tauscope.load_robot(Path(__file__).parent / "two_joint_arm.yaml")
CONCEALED = {"torque_noise_std": [0.2, 0.1], "effects": [{"effect": "joint_spring", "joint": 1, "stiffness": 5.0}]}


def record(motion, seed):
    """Record a motion on the arm that conceals a spring."""
    return tauscope.simulate(robot, motion, scenario={**CONCEALED, "seed": seed}, rate_hz=100, name=f"recording {seed}")


# %%
motions = [
    tauscope.design_excitation(robot, period_s=3.0, harmonics=3, periods=2, slow_reversals=False, seed=seed)
    for seed in (0, 1)
]
print(f"condition number {motions[0].design.condition_number:.1f}")
train, judge = (record(motion, seed) for seed, motion in enumerate(motions))

# %%
identification = tauscope.identify(robot, train, held_out=judge)
print(f"held-out error of the plain model: {identification.document.fit.held_out.relative_error:.1%}")

# %%
diagnosis = tauscope.diagnose(robot, train, held_out=judge)
print(f"verdict: {diagnosis.document.verdict}")
print(diagnosis.to_frame().to_string())

# %% [markdown]
# Where something stays open, the diagnosis plans the next motion.

# %%
recordings = [train]
if diagnosis.planned is not None:
    print(diagnosis.document.next_experiment.why)
    recordings.append(record(diagnosis.planned.trajectory, 2))
    diagnosis = tauscope.diagnose(robot, recordings, held_out=judge)
    print(f"verdict after one more recording: {diagnosis.document.verdict}")
    print(diagnosis.to_frame().to_string())

# %%
diagnosis.plot()
