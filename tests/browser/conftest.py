"""The page in the system's Chromium, before a service in a process of its own."""

import os
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, BrowserContext, Page, expect, sync_playwright

from server.http.serving import Served, served
from shared_data import REPOSITORY

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
IMAGES = REPOSITORY / "docs" / "images"
KEEP = "TAUSCOPE_SCREENSHOTS"
"""Set in the environment, the screenshots of the documentation are taken anew."""

PATIENCE_MS = 60_000
SERIOUS = ("serious", "critical")


@pytest.fixture(scope="session")
def chromium() -> Iterator[Browser]:
    """The system's Chromium."""
    if CHROMIUM is None:
        pytest.skip("no Chromium; install the Debian package chromium")
    expect.set_options(timeout=PATIENCE_MS)
    with sync_playwright() as playwright:
        # The sandbox needs privileges that a container does not give; nothing foreign is opened here.
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """A service on a data folder of its own."""
    with served(tmp_path_factory.mktemp("data")) as running:
        yield running


@dataclass
class Visit:
    """A visit to the page, and what it asked for meanwhile."""

    url: str
    context: BrowserContext
    page: Page
    hosts: set[str] = field(default_factory=set)
    errors: list[str] = field(default_factory=list)

    def go(self, path: str) -> None:
        self.page.goto(f"{self.url}/#{path}")

    def barriers(self) -> list[str]:
        """What keeps people out, as axe finds it."""
        found = Axe().run(self.page).response["violations"]
        return [f"{each['id']}: {each['nodes'][0]['html']}" for each in found if each["impact"] in SERIOUS]

    def keep(self, name: str, folder: Path) -> None:
        """Take a screenshot, for the documentation where that is asked for."""
        self.page.screenshot(path=(IMAGES if os.environ.get(KEEP) else folder) / f"{name}.png")


@pytest.fixture
def visit(chromium: Browser, service: Served) -> Iterator[Visit]:
    """One visit; on leaving: no request went elsewhere, and no script failed."""
    context = chromium.new_context(viewport={"width": 1280, "height": 860}, color_scheme="light", locale="en-GB")
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    shown = Visit(str(service.client.base_url).rstrip("/"), context, page)
    context.on("request", lambda request: shown.hosts.add(urlsplit(request.url).netloc))
    page.on("pageerror", lambda error: shown.errors.append(str(error)))
    yield shown
    context.close()
    assert shown.hosts - {""} <= {urlsplit(shown.url).netloc}
    assert shown.errors == []
