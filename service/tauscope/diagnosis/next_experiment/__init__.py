"""The motion that decides what a diagnosis leaves open."""

from tauscope.diagnosis.next_experiment.plan import PlannedExperiment, is_wanted, plan_experiment, planned_experiment

__all__ = ["PlannedExperiment", "is_wanted", "plan_experiment", "planned_experiment"]
