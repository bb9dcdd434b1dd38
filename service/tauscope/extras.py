"""Modules that are not everywhere: which extra installs one, and which need a POSIX system."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from tauscope.errors import MissingExtraError, TauscopeError

EXTRAS: Mapping[str, tuple[str, ...]] = {
    "service": (
        "alembic",
        "apscheduler",
        "fastapi",
        "markdown_it",
        "prometheus_client",
        "psycopg",
        "python_multipart",
        "sqlalchemy",
        "starlette",
        "structlog",
        "uplot",
        "uvicorn",
    ),
    "hardware": ("can", "canopen", "dynamixel_sdk", "serial"),
    "sim": ("mujoco",),
    "fleet": ("distributed",),
    "parquet": ("pyarrow",),
    "ros1": ("rosbags",),
    "cloud": ("aiohttp", "gcsfs", "s3fs", "upath"),
    "pandas": ("pandas",),
    "headroom": ("sklearn",),
}
"""Top-level modules of each extra in pyproject.toml."""

POSIX_ONLY = ("fcntl", "resource", "termios")
"""Modules of the standard library that Windows lacks."""


@contextmanager
def require_extra(user: str) -> Iterator[None]:
    """Say in one line what is needed, where an import fails because an extra or a POSIX module is missing.

    Raises MissingExtraError where an optional dependency is not installed. Raises TauscopeError where the operating
    system lacks a POSIX module.

    Parameters
    ----------
    user : str
        what needs the extra, as the first words of the message
    """
    try:
        yield
    except ModuleNotFoundError as error:
        module = (error.name or "").partition(".")[0]
        if module in POSIX_ONLY:
            needs = "moving arms and serving need a POSIX system, such as Linux"
            raise TauscopeError(f"{user} cannot run on this system: {needs}") from error
        for extra, modules in EXTRAS.items():
            if module in modules:
                raise MissingExtraError(f"{user} needs the {extra} extra: pip install 'tauscope[{extra}]'") from error
        raise
