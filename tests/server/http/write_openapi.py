"""The committed OpenAPI document: `python tests/server/http/write_openapi.py` writes it under a version of its own.

``openapi_versions.json`` holds the hash of every version's document: a version that is there already is not given to
another document. ``--amend`` does so all the same, for a version that nobody outside the branch has seen.
"""

import hashlib
import json
import sys
import tempfile
from pathlib import Path

COMMITTED = Path(__file__).parent / "openapi.json"
VERSIONS = Path(__file__).parent / "openapi_versions.json"


def document_text() -> str:
    """The document of the present code."""
    from tauscope.server.http import Settings, create_app

    document = create_app(Settings(data_folder=Path(tempfile.gettempdir()))).openapi()
    return json.dumps(document, indent=1, ensure_ascii=False) + "\n"


def document_hash(text: str) -> str:
    """What a version stands for."""
    return hashlib.sha256(text.encode()).hexdigest()


def known_versions() -> dict[str, str]:
    """Hash of the document by version."""
    return json.loads(VERSIONS.read_text(encoding="utf-8"))


def write(amend: bool) -> str | None:
    """Write document and version; why not, where that cannot be."""
    text, versions = document_text(), known_versions()
    version = json.loads(text)["info"]["version"]
    if versions.get(version, document_hash(text)) != document_hash(text) and not amend:
        return f"version {version} is another document: raise API_VERSION in service/tauscope/server/http/app.py"
    COMMITTED.write_text(text, encoding="utf-8")
    VERSIONS.write_text(json.dumps({**versions, version: document_hash(text)}, indent=1) + "\n", encoding="utf-8")
    return None


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[3]))
    sys.exit(write("--amend" in sys.argv[1:]))
