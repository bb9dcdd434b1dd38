# %% [markdown]
# # Your simulation against your recordings
# Give recordings of the arm and recordings of the same motion in your simulator. Tauscope says which values are wrong
# in the simulation and which physics it lacks.

# %%
from pathlib import Path

import tauscope

robot = tauscope.load_robot(Path(__file__).parent / "two_joint_arm.yaml")
motion = tauscope.design_excitation(robot, period_s=3.0, harmonics=3, periods=2, slow_reversals=False)
check = tauscope.design_excitation(robot, period_s=3.0, harmonics=3, periods=2, slow_reversals=False, seed=1)

# %% [markdown]
# Stand-ins for your files: the "real" arm has a spring at the elbow, the simulation does not.

# %%
spring = [{"effect": "joint_spring", "joint": 2, "stiffness": 3.0}]
noise = [0.2, 0.1]
real = tauscope.simulate(
    robot, motion, scenario={"torque_noise_std": noise, "seed": 1, "effects": spring}, rate_hz=100, name="real"
)
judge = tauscope.simulate(
    robot, check, scenario={"torque_noise_std": noise, "seed": 2, "effects": spring}, rate_hz=100, name="judge"
)
simulated = tauscope.simulate(robot, motion, rate_hz=100, name="simulated")

# %%
result = tauscope.diagnose(robot, real, held_out=judge, against=simulated)
print(f"verdict: {result.document.verdict}")
for finding in result.document.findings:
    print(finding.statement)
print(result.to_frame().to_string())

# %%
result.plot()
