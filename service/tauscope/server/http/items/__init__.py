"""The index: what is kept, searched."""
