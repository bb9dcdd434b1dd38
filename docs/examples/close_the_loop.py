# %% [markdown]
# # A position-controlled arm whose simulation moves otherwise
# Positions and commands of the real arm are enough: torque is made of the MJCF's own gains. The result is the same
# MJCF with the identified values, and the rollout says how much nearer the simulated arm comes.

# %%
import tempfile
from pathlib import Path

import mujoco
import numpy as np
import pandas as pd

import tauscope
from tauscope.cli import main
from tauscope_sim.mujoco_log import MujocoLog

mjcf = Path(__file__).parent / "position_arm.xml"
folder = Path(tempfile.mkdtemp())


# %% [markdown]
# Stand-in for your arm: heavier links, more friction, and commands that come 20 ms late. It reports what a position
# servo reports: counts of a 12-bit encoder and targets, 125 times a second. Record your own arm instead: columns t,
# q1…, qref1… in a CSV.


# %%
COUNT = 2.0 * np.pi / 4096  # [rad]


def command(time: float, seed: int) -> np.ndarray:
    """A smooth wave at every joint, of seven harmonics."""
    rng = np.random.default_rng(seed)
    rates = 2.0 * np.pi * np.arange(1, 8) / 5.0
    return np.sin(rates * time + rng.uniform(0.0, 6.28, (3, 7))) @ (0.3 / np.sqrt(np.arange(1, 8)))


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
    rows = pd.read_csv(path, comment="#").iloc[::4]
    angles = ["q1", "q2", "q3"]
    rows[angles] = np.round(rows[angles] / COUNT) * COUNT
    rows[["t", *angles, "qref1", "qref2", "qref3"]].to_csv(path, index=False)
    return path


train = [record(seed, folder / f"train{seed}.csv") for seed in (1, 3)]
judge = record(2, folder / "judge.csv")

# %% [markdown]
# Identify from positions and commands. The warnings say what the torque is made of, and what sets its scale.

# %%
saved, patched = folder / "model.json", folder / "patched.xml"
assert main(["identify", str(mjcf), *map(str, train), "--held-out", str(judge), "--model", str(saved)]) == 0
assert main(["export", str(saved), str(patched), "--onto", str(mjcf)]) == 0

# %% [markdown]
# Roll out on motion that was not used: your file as it was, the identified model, and the patched file by itself.

# %%
rollout = tauscope.rollout(mjcf, judge, model=saved)
before, after = (np.array(entry.rms) for entry in rollout.document.summary)
pasted = np.array(tauscope.rollout(patched, judge).document.summary[0].rms)
for joint, *errors in zip(rollout.document.joints, before, after, pasted, strict=True):
    old, new, own = (f"{1e3 * error:.1f} mrad" for error in errors)
    print(f"{joint}: {old} before, {new} after, {own} in {patched.name}")
print(f"the mean error falls by a factor of {before.mean() / pasted.mean():.1f}")

# %%
rollout.plot()
