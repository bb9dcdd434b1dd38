"""Where everything lies in a data folder."""

from pathlib import Path

from tauscope.server.store.items import ItemStore

FOLDERS = {
    "excitation": "excitations",
    "run": "runs",
    "identification": "identifications",
    "diagnosis": "diagnoses",
    "campaign": "campaigns",
}
"""The folder of each kind of item, below the data folder; its collection has the same name at the API."""

RECORDINGS = "recordings"


def item_stores(data_folder: Path) -> dict[str, ItemStore]:
    """The folders of every kind of item, made where they are missing."""
    return {kind: ItemStore(data_folder / name, kind) for kind, name in FOLDERS.items()}
