# %% [markdown]
# # A position-controlled arm whose simulation moves otherwise
# Positions and commands of the real arm are enough: torque is made of the MJCF's own gains. The result is the same
# MJCF with the identified values, and the rollout says how much nearer the simulated arm comes.

# %%
import tempfile
from pathlib import Path

import mujoco
import numpy as np

import tauscope
from tauscope.cli import main
from tauscope_sim.mujoco_log import MujocoLog

mjcf = Path(__file__).parent / "position_arm.xml"
folder = Path(tempfile.mkdtemp())


# %% [markdown]
# Stand-in for your arm: heavier links, more friction, and commands that come 20 ms late. Record your own arm instead:
# columns t, q1…, qref1… in a CSV.


# %%
def command(time: float, seed: int) -> np.ndarray:
    """A smooth wave at every joint, of seven harmonics."""
    rng = np.random.default_rng(seed)
    rates = 2.0 * np.pi * np.arange(1, 8) / 10.0
    return np.sin(rates * time + rng.uniform(0.0, 6.28, (3, 7))) @ (0.45 / np.sqrt(np.arange(1, 8)))


def record(seed: int, path: Path) -> Path:
    """20 s of the stand-in."""
    model = mujoco.MjModel.from_xml_path(str(mjcf))
    model.body_mass[1:] *= [1.0, 1.8, 2.5]
    model.body_inertia[1:] *= np.array([1.0, 1.8, 2.5])[:, None]
    model.dof_frictionloss[:] = [0.20, 0.15, 0.10]
    model.dof_solref[:], model.dof_solimp[:] = [0.004, 1.0], [0.9999, 0.9999, 0.001, 0.5, 2.0]  # rest is rest
    model.dof_damping[:] = [0.15, 0.20, 0.12]
    data = mujoco.MjData(model)
    data.qpos[:] = command(0.0, seed)
    log = MujocoLog(model, data)
    while data.time < 20.0:
        data.ctrl[:] = command(data.time - 0.020, seed)
        log.step(command(data.time, seed))
    log.save(path, with_torque=False)
    return path


train, judge = record(1, folder / "train.csv"), record(2, folder / "judge.csv")

# %% [markdown]
# Identify from positions and commands. The warnings say what the torque is made of, and what sets its scale.

# %%
saved, patched = folder / "model.json", folder / "patched.xml"
assert main(["identify", str(mjcf), str(train), "--held-out", str(judge), "--model", str(saved)]) == 0
assert main(["export", str(saved), str(patched), "--onto", str(mjcf)]) == 0

# %% [markdown]
# Roll both out on motion that was not used: your file as it was, and with the identified values.

# %%
rollout = tauscope.rollout(mjcf, judge, model=saved)
before, after = (np.array(entry.rms) for entry in rollout.document.summary)
for joint, old, new in zip(rollout.document.joints, before, after, strict=True):
    print(f"{joint}: {1e3 * old:.1f} mrad before, {1e3 * new:.1f} mrad after")
print(f"the mean error falls by a factor of {before.mean() / after.mean():.1f}; {patched.name} holds the values")

# %%
rollout.plot()
