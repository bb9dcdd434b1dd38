"""Diagnoses: handed in, followed, their results, figures and models fetched."""
