"""Build the site: `python -m docs.site FOLDER`. A warning of Sphinx and a broken link are errors."""

import shutil
import sys
from pathlib import Path

from sphinx.cmd.build import main as run_sphinx

from docs.site.cli_page import cli_page
from docs.site.links import find_faults
from docs.site.navigation import REPOSITORY
from docs.site.python_page import python_page
from docs.site.rest_page import rest_page, schemas_page
from docs.site.sources import write_sources, write_text

PAGES = {"python": python_page, "cli": cli_page, "rest": rest_page, "schemas": schemas_page}


def build(folder: Path) -> int:
    """Build the site into a folder, anew; the exit status."""
    shutil.rmtree(folder, ignore_errors=True)
    sources, site = folder / "sources", folder / "html"
    write_sources(sources)
    for name, page in PAGES.items():
        write_text(sources / "reference" / f"{name}.md", page())
    settings = str(REPOSITORY / "docs" / "site")
    strict = ["-q", "-W", "--keep-going"]
    status = run_sphinx([*strict, "-c", settings, "-d", str(folder / "trees"), str(sources), str(site)])
    faults = list(find_faults(site)) if status == 0 else []
    for fault in faults:
        sys.stderr.write(f"{fault}\n")
    return status or bool(faults)


if __name__ == "__main__":
    sys.exit(build(Path(sys.argv[1])))
