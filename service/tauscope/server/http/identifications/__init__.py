"""Identifications: handed in, followed, their results and exports fetched."""
