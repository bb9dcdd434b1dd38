"""Recordings on the server: sent, listed, checked."""
