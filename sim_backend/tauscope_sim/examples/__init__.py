"""Robot files that come with Tauscope."""

from importlib.resources import files
from pathlib import Path

from tauscope.errors import NotFoundError


def example_robot(name: str) -> Path:
    """Path of a robot file that comes with Tauscope. Raises NotFoundError where there is no example of that name."""
    folder = Path(str(files(__name__)))
    known = {path.stem: path for path in sorted(folder.glob("*.yaml"))}
    if name not in known:
        raise NotFoundError(f"example robot {name!r}: not there; there are: {', '.join(known)}")
    return known[name]
