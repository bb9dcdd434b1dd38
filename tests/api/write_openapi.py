"""The committed OpenAPI document: `python tests/api/write_openapi.py` writes it anew."""

import json
import sys
import tempfile
from pathlib import Path

COMMITTED = Path(__file__).parent / "openapi.json"


def document_text() -> str:
    """The document of the present code."""
    from service.api import Settings, create_app

    document = create_app(Settings(data_folder=Path(tempfile.gettempdir()))).openapi()
    return json.dumps(document, indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[2]))
    COMMITTED.write_text(document_text(), encoding="utf-8")
