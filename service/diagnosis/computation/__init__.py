"""How the same work is not done twice, and independent work is done side by side."""
