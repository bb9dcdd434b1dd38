"""Layouts of other tools: which of a file's columns is which, by preset, by the user's mapping, or by a guess."""
