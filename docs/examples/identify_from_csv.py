# %% [markdown]
# # A CSV and a URDF give a model
# `two_joint_arm.yaml` names the URDF and the joints. Replace both files and `recordings` by your own.

# %%
import json
import tempfile
from pathlib import Path

import tauscope

robot = tauscope.load_robot(Path(__file__).parent / "two_joint_arm.yaml")
folder = Path(tempfile.mkdtemp(prefix="tauscope-example-"))

# %% [markdown]
# The simulated arm makes two recordings here: columns `t`, `q1`, `q2`, `tau1`, `tau2`.

# %%
noise = {"torque_noise_std": [0.2, 0.1]}
recordings = []
for seed in (0, 1):
    motion = tauscope.design_excitation(robot, period_s=3.0, harmonics=3, periods=2, slow_reversals=False, seed=seed)
    frame = tauscope.simulate(robot, motion, scenario={**noise, "seed": seed}, rate_hz=100).to_frame()
    recordings.append(folder / f"recording-{seed}.csv")
    frame[["t", "q1", "q2", "tau1", "tau2", "period"]].to_csv(recordings[-1], index=False)

# %% [markdown]
# Identify on the first recording; judge on the second.

# %%
result = tauscope.identify(robot, recordings[0], held_out=recordings[1])
print(result.to_frame().to_string())
print(f"relative error on held-out motion: {result.document.fit.held_out.relative_error:.1%}")

# %%
(folder / "model.json").write_text(json.dumps(result.to_dict(), indent=1))
result.plot().savefig(folder / "torque.png")
print(f"wrote {folder}: model.json, torque.png")

# %% [markdown]
# `tauscope identify ROBOT RECORDING --export arm.urdf` writes the model into the URDF.
