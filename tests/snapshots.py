"""Data folders of earlier versions, as tests find them."""

import tarfile
from pathlib import Path

SNAPSHOTS = sorted((Path(__file__).parent / "server" / "store" / "snapshots").glob("*.tar.xz"))


def unpacked(snapshot: Path, folder: Path) -> Path:
    """The data folder of a version, in a folder of the test's."""
    with tarfile.open(snapshot) as archive:
        # Python 3.11 before 3.11.4, which Debian 12 has, extracts without filters: these archives are our own.
        archive.extraction_filter = getattr(tarfile, "data_filter", None)
        archive.extractall(folder)
    return folder / "data"
