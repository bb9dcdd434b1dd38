"""Messages about files on the server, in the words of whoever sent them."""

from pathlib import Path


def without_folders(text: str, *folders: Path) -> str:
    """A message that calls files by their names alone, and says nothing of the server's folders.

    Parameters
    ----------
    text : str
        a message that may hold paths
    folders : Path
        the folders in which the files lie
    """
    for folder in folders:
        text = text.replace(f"{folder}/", "")
    return text
