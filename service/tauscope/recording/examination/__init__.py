"""Columns in another unit, and samples that were never measured: refused, masked or repaired."""
