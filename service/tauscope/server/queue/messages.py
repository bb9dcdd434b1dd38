"""Messages about files on the server, in the words of whoever sent them."""

from pathlib import Path


def without_folders(text: str, *folders: Path) -> str:
    """A message that calls files by their names alone, and says nothing of the server's folders."""
    for folder in folders:
        text = text.replace(f"{folder}/", "")
    return text
