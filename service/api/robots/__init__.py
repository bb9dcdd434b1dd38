"""Robot files: received, checked."""
