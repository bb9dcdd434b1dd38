"""The motion to record next."""

import numpy as np
from matplotlib.figure import Figure

from tauscope.report.svg import PREDICTED, draw_svg
from tauscope.trajectory import Trajectory

MOST_SAMPLES = 700
ROW_INCHES = 0.55


def motion_figure(name: str, trajectory: Trajectory, joints: list[str]) -> str:
    """Draw every joint's position over time."""
    sampled = trajectory.evaluate(np.linspace(0.0, trajectory.duration_s, MOST_SAMPLES))

    def draw(figure: Figure) -> None:
        axes = np.atleast_1d(figure.subplots(len(joints), 1, sharex=True))
        for number, (axis, joint) in enumerate(zip(axes, joints, strict=True)):
            axis.plot(sampled.time, sampled.position[:, number], color=PREDICTED, linewidth=0.9)
            axis.set_ylabel(joint if len(joint) <= 12 else joint[:11] + "…", rotation=0, ha="right", va="center")
            axis.margins(x=0.0)
        axes[-1].set_xlabel("time [s]")

    return draw_svg(name, 0.5 + ROW_INCHES * len(joints), draw)
