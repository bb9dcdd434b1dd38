"""The recordings as a diagnosis sees them: rows in one band, each joint's noise white."""
