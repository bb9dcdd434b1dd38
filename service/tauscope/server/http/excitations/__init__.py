"""Excitations: motions designed for a robot, followed, fetched as documents and as trajectories."""
