"""Both kinds of database, for the tests of the store."""

from databases import address, database, postgres

__all__ = ["address", "database", "postgres"]
