"""Results of ``import tauscope``: JSON as in CONTRACT.md, a pandas table, a Matplotlib figure."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel

from tauscope.extras import require_extra

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from tauscope.closed_loop import Rollout, RolloutDocument
    from tauscope.diagnosis import Diagnosis, DiagnosisDocument
    from tauscope.diagnosis.documents.result import HeadroomEntry
    from tauscope.diagnosis.next_experiment import PlannedExperiment
    from tauscope.excitation import ExcitationDesign
    from tauscope.identification import Identification, IdentificationDocument
    from tauscope.recording import Recording

SAMPLE_STEP_S = 0.01
"""Sampling of a designed motion [s]."""


@dataclass(frozen=True, eq=False)
class IdentificationResult:
    """An identified arm."""

    identification: "Identification"
    recordings: "tuple[Recording, ...]"
    held_out: "tuple[Recording, ...]"

    @cached_property
    def document(self) -> "IdentificationDocument":
        """The result, typed."""
        from tauscope.identification import document

        return document(self.identification)

    def to_dict(self) -> dict[str, Any]:
        """Schema ``tauscope.identification/1``."""
        return _to_dict(self.document)

    def to_frame(self) -> "pd.DataFrame":
        """One row a parameter: name, value, std [SI]; std is NaN where it was not estimated."""
        rows = [(entry.name, entry.value, entry.std) for entry in self.document.base_parameters]
        for friction in self.document.friction:
            names = ("stiction", "stribeck", "viscous", "offset")
            rows += [(f"{name} {friction.joint}", getattr(friction, name), friction.std.get(name)) for name in names]
        rows += [(f"rotor_inertia {rotor.joint}", rotor.value, rotor.std) for rotor in self.document.rotor_inertia]
        return _frame(rows, ("parameter", "value", "std")).astype({"value": float, "std": float})

    def plot(self) -> "Figure":
        """Measured and predicted torque of every joint, on held-out motion where there is some."""
        from tauscope.report.curves import torque_series

        series = torque_series(self.identification, (self.held_out or self.recordings)[0])
        figure, axes = _axes(self.document.joints, "torque [Nm or N]")
        for joint, axis in enumerate(axes):
            axis.plot(series.time, series.measured[:, joint], label="measured")
            axis.plot(series.time, series.predicted[:, joint], label="model")
        axes[0].legend(loc="upper right")
        return figure


@dataclass(frozen=True, eq=False)
class DiagnosisResult:
    """A diagnosed arm."""

    diagnosis: "Diagnosis"
    planned: "PlannedExperiment | None"
    headroom: "list[HeadroomEntry] | None" = None

    @cached_property
    def document(self) -> "DiagnosisDocument":
        """The result, typed."""
        from tauscope.diagnosis import document

        return document(self.diagnosis, self.planned, headroom=self.headroom)

    def to_dict(self) -> dict[str, Any]:
        """Schema ``tauscope.diagnosis/1``."""
        return _to_dict(self.document)

    def to_frame(self) -> "pd.DataFrame":
        """One row a parameter of a finding: effect, joint, probability, parameter, value, std, unit."""
        rows = [
            (finding.effect, finding.joint, finding.probability, entry.name, entry.value, entry.std, entry.unit)
            for finding in self.document.findings
            for entry in finding.parameters
        ]
        return _frame(rows, ("effect", "joint", "probability", "parameter", "value", "std", "unit"))

    def plot(self) -> "Figure":
        """Torque of every joint: measured, and predicted without and with the findings."""
        from tauscope.diagnosis.documents.plots import diagnosis_plots

        overlays = diagnosis_plots(self.diagnosis).overlays
        figure, axes = _axes([overlay.joint for overlay in overlays], "torque [Nm or N]")
        for overlay, axis in zip(overlays, axes, strict=True):
            axis.plot(overlay.time, overlay.measured, label="measured")
            axis.plot(overlay.time, overlay.before, label="without the findings")
            axis.plot(overlay.time, overlay.after, label="with the findings")
        axes[0].legend(loc="upper right")
        return figure


@dataclass(frozen=True, eq=False)
class RolloutResult:
    """Real and simulated motion."""

    rollout: "Rollout"

    @cached_property
    def document(self) -> "RolloutDocument":
        """The result, typed."""
        return self.rollout.document

    def to_dict(self) -> dict[str, Any]:
        """Schema ``tauscope.rollout/1``."""
        return _to_dict(self.document)

    def to_frame(self) -> "pd.DataFrame":
        """One row a recording, model and joint: rms, worst [rad or m], lag [s]."""
        rows = [
            (recording.recording, entry.model, joint, entry.rms[place], entry.worst[place], entry.lag[place])
            for recording in self.document.recordings
            for entry in recording.models
            for place, joint in enumerate(self.document.joints)
        ]
        return _frame(rows, ("recording", "model", "joint", "rms", "worst", "lag"))

    def plot(self) -> "Figure":
        """Real and simulated position of every joint, in the first recording."""
        trace = self.rollout.traces[0]
        figure, axes = _axes(self.document.joints, "position [rad or m]")
        for joint, axis in enumerate(axes):
            axis.plot(trace.motion.rows, trace.motion.measured[:, joint], label="real")
            for model, positions in trace.simulated.items():
                axis.plot(trace.motion.rows, positions[:, joint], label=model)
        axes[0].legend(loc="upper right")
        return figure


@dataclass(frozen=True, eq=False)
class ExcitationResult:
    """A designed motion."""

    design: "ExcitationDesign"

    def to_dict(self) -> dict[str, Any]:
        """The design, trajectory included, as ``tauscope excite --json`` writes it."""
        from tauscope.excitation import excitation_document

        return _to_dict(excitation_document(self.design))

    def to_frame(self) -> "pd.DataFrame":
        """One row a sample: t, q1…qn, qd1…qdn, qdd1…qddn [SI]."""
        sampled = self._samples()
        columns: dict[str, Any] = {"t": sampled.time}
        for group, values in (("q", sampled.position), ("qd", sampled.velocity), ("qdd", sampled.acceleration)):
            columns |= {f"{group}{joint + 1}": values[:, joint] for joint in range(values.shape[1])}
        return _frame(columns)

    def plot(self) -> "Figure":
        """Position of every joint."""
        sampled = self._samples()
        figure, axes = _axes(self.design.trajectory.joints, "position [rad or m]")
        for joint, axis in enumerate(axes):
            axis.plot(sampled.time, sampled.position[:, joint])
        return figure

    def _samples(self) -> Any:
        import numpy as np

        trajectory = self.design.trajectory
        return trajectory.evaluate(np.arange(0.0, trajectory.duration_s, SAMPLE_STEP_S))


@dataclass(frozen=True, eq=False)
class SimulationResult:
    """What the simulated arm recorded; `identify` and `diagnose` take it as a recording."""

    recording: "Recording"

    def to_dict(self) -> dict[str, Any]:
        """The recording's columns, by the names of a recording file."""
        return {name: values.tolist() for name, values in self._columns().items()}

    def to_frame(self) -> "pd.DataFrame":
        """One row a sample, the columns of a recording file."""
        return _frame(self._columns())

    def plot(self) -> "Figure":
        """Torque of every joint."""
        samples = self.recording.samples()
        names = [f"joint {number}" for number in range(1, self.recording.joint_count + 1)]
        figure, axes = _axes(names, "torque [Nm or N]")
        for joint, axis in enumerate(axes):
            axis.plot(samples.time, samples.effort[:, joint])
        return figure

    def _columns(self) -> dict[str, Any]:
        table = self.recording.table
        rows = table.rows(0, len(table))
        return {name: rows[:, place] for place, name in enumerate(table.names)}


def _to_dict(document: BaseModel) -> dict[str, Any]:
    """What the command writes as JSON: not-a-number is null."""
    return json.loads(document.model_dump_json(by_alias=True))


def _frame(data: Sequence[tuple[Any, ...]] | Mapping[str, Any], columns: Sequence[str] | None = None) -> "pd.DataFrame":
    """A pandas table."""
    with require_extra("to_frame"):
        import pandas as pd
    return pd.DataFrame(data, columns=None if columns is None else list(columns))


def _axes(titles: Sequence[str], label: str) -> "tuple[Figure, list[Axes]]":
    """A figure with one row of axes a joint, over time."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 0.6 + 1.7 * len(titles)), layout="constrained")
    axes = list(figure.subplots(len(titles), 1, sharex=True, squeeze=False)[:, 0])
    for axis, title in zip(axes, titles, strict=True):
        axis.set_title(title, loc="left")
        axis.set_ylabel(label)
    axes[-1].set_xlabel("time [s]")
    return figure, axes
