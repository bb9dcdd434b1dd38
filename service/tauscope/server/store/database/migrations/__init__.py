"""Steps from one form of the tables to the next, taken by Alembic."""
