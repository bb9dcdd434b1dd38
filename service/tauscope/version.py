"""The version that stands in what the service writes and answers."""

from functools import cache
from importlib.metadata import PackageNotFoundError, version


@cache  # to find it out, every folder on Python's path is looked into
def tauscope_version() -> str:
    """Version of the installed package; "0+source" where it runs from a source tree that was never installed."""
    try:
        return version("tauscope")
    except PackageNotFoundError:
        return "0+source"
