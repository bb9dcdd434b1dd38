"""Joints whose held-out residual the findings make larger."""

import numpy as np

from concealed.running.kept import Outcome

HARM = 16.0
"""Two standard errors of a joint's change for the worse, by closed form: a torque δ that is wrongly added to N
independent residuals r changes their mean square by δ², with a standard error of 2 |r| |δ| / √N. So a rise of the mean
square by a share of 16 / N is two standard errors."""

SHORTEST_S = 10.0
"""Length of the held-out motion of outcomes that do not state it [s]."""


def worse_joints(each: Outcome) -> list[str]:
    """Joints made worse by more than two standard errors of the difference; none without held-out motion."""
    found = each["diagnosis"]
    change = found["fit"]["held_out"]
    if change is None:
        return []
    before, after = np.array(change["rms_before"], float), np.array(change["rms_after"], float)
    # A band so wide has so many independent samples.
    count = 2.0 * found["cutoff_hz"] * each["case"].get("held_out_s", SHORTEST_S)
    worse = after**2 > before**2 * (1.0 + HARM / max(count, 1.0))
    return [name for name, is_worse in zip(found["joints"], worse, strict=True) if is_worse]
