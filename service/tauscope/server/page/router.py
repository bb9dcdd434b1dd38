"""The page and its files."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.metadata import distribution
from pathlib import Path

from fastapi import APIRouter, Request, Response

from tauscope.errors import NotFoundError
from tauscope.robot.messages import shown
from tauscope.runtime.drivers import driver_names, find_driver
from tauscope.server.page.example import example_files

router = APIRouter(include_in_schema=False)
STATIC = Path(__file__).parent / "static"
MEDIA_TYPES: Mapping[str, str] = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
}
PLOT_LIBRARY: Mapping[str, str] = {"uplot.js": "uplot/static/uPlot.iife.js", "uplot.css": "uplot/static/uPlot.min.css"}
"""Files of the installed package uplot-python, by the names that the page knows them by."""
HEADERS: Mapping[str, str] = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:;"
    " connect-src 'self'; form-action 'none'; base-uri 'none'; frame-ancestors 'none'",
    "Cache-Control": "no-cache",
}


@dataclass(frozen=True)
class Asset:
    content: bytes
    media_type: str
    tag: str


@router.get("/")
def show_page(request: Request) -> Response:
    return _answer(request, "index.html")


@router.get("/page/{name}")
def show_asset(request: Request, name: str) -> Response:
    return _answer(request, name)


def _answer(request: Request, name: str) -> Response:
    asset = assets().get(name)
    if asset is None:
        raise NotFoundError(f"the page has no file {shown(name)}; open / instead")
    headers = {**HEADERS, "ETag": asset.tag}
    if request.headers.get("if-none-match") == asset.tag:
        return Response(status_code=304, headers=headers)
    return Response(asset.content, media_type=asset.media_type, headers=headers)


@router.get("/example/{name}")
def show_example(name: str) -> Response:
    content = example_files().get(name)
    if content is None:
        raise NotFoundError(f"the example has no file {shown(name)}; it has {', '.join(example_files())}")
    return Response(content, media_type="application/octet-stream", headers=HEADERS)


@cache
def assets() -> Mapping[str, Asset]:
    package = distribution("uplot-python")
    paths = {path.name: path for path in sorted(STATIC.iterdir()) if path.suffix in MEDIA_TYPES}
    paths |= {name: Path(str(package.locate_file(file))) for name, file in PLOT_LIBRARY.items()}
    contents = {name: path.read_bytes() for name, path in paths.items()}
    contents["drivers.js"] = _drivers_script()
    return {
        name: Asset(content, MEDIA_TYPES[Path(name).suffix], f'"{hashlib.sha256(content).hexdigest()[:24]}"')
        for name, content in contents.items()
    }


def _drivers_script() -> bytes:
    """The registered drivers as a module of the page: title, and whether each is a simulation."""
    drivers = [find_driver(name) for name in driver_names()]
    content = {one.name: {"title": one.title, "is_simulated": one.is_simulated} for one in drivers}
    return f"export const DRIVERS = {json.dumps(content, ensure_ascii=False)};\n".encode()
