"""Requests that may be repeated: with the same Idempotency-Key nothing is done twice."""
