"""Runs and campaigns: who may move which arm, and what a run leaves."""
