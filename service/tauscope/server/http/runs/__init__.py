"""Runs: begun, followed, stopped at any time, their recordings fetched."""
