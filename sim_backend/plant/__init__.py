"""Forward physics of the simulated arm: what torque does to it."""

from sim_backend.plant.plant import STEP, Plant, PlantState
from sim_backend.plant.term import AMBIENT

__all__ = ["AMBIENT", "STEP", "Plant", "PlantState"]
