"""Forward physics of the simulated arm: what torque does to it."""

from tauscope_sim.plant.plant import Plant
from tauscope_sim.plant.term import AMBIENT

__all__ = ["AMBIENT", "Plant"]
