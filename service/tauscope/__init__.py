"""Tauscope: a robot arm's true dynamics from its own motion, and what its simulation left out."""
