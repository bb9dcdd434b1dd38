"""The database: an index of the folders, and what has no folder."""
