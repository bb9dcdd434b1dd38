"""Data folders of earlier versions, as tests find them."""

import tarfile
from pathlib import Path

SNAPSHOTS = sorted((Path(__file__).parent / "store" / "snapshots").glob("*.tar.xz"))


def unpacked(snapshot: Path, folder: Path) -> Path:
    """The data folder of a version, in a folder of the test's."""
    with tarfile.open(snapshot) as archive:
        archive.extractall(folder, filter="data")
    return folder / "data"
