"""Arm physics for tests, demonstrations and the simulated backend; the multibody dynamics are MuJoCo's.

Nothing of service's dynamics, identification or diagnosis is imported here: the judge and the judged share no formula.
"""

import os

# Nothing is drawn here. Unless told, MuJoCo looks for a window system while it is imported, by programs that it starts
# for that: a third of a simulated run's beginning.
os.environ.setdefault("MUJOCO_GL", "disable")
