"""The name of a data folder, by which one database tells several of them apart."""

import json
import secrets
from pathlib import Path

from tauscope.errors import StoreError
from tauscope.files import write_atomically

FILE_NAME = "site.json"


def site_identifier(data_folder: Path) -> str:
    """The identifier of a data folder; given to it when it is opened for the first time, and kept with it.

    Raises
    ------
    StoreError
        if its ``site.json`` is damaged
    """
    path = data_folder / FILE_NAME
    try:
        identifier = json.loads(path.read_bytes())["identifier"]
    except FileNotFoundError:
        identifier = secrets.token_hex(8)
        write_atomically(path, json.dumps({"form": "tauscope.site/1", "identifier": identifier}).encode())
    except (ValueError, TypeError, KeyError):
        identifier = None
    if not isinstance(identifier, str) or not identifier.isalnum():
        hint = "restore it from a backup, or remove it: the folder then counts as a new one"
        raise StoreError(f"{path}: is damaged; {hint}")
    return identifier
