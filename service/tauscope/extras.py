"""Optional dependencies: which extra of the distribution installs a module."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from tauscope.errors import MissingExtraError

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
    "pandas": ("pandas",),
}
"""Top-level modules of each extra in pyproject.toml."""


@contextmanager
def require_extra(user: str) -> Iterator[None]:
    """Say in one line what to install, where an import fails because an extra is missing.

    Parameters
    ----------
    user : str
        what needs the extra, as the first words of the message

    Raises
    ------
    MissingExtraError
        an optional dependency is not installed
    """
    try:
        yield
    except ModuleNotFoundError as error:
        module = (error.name or "").partition(".")[0]
        for extra, modules in EXTRAS.items():
            if module in modules:
                raise MissingExtraError(f"{user} needs the {extra} extra: pip install 'tauscope[{extra}]'") from error
        raise
