"""A service that asks for keys, and clients with one key each."""

from datetime import UTC, datetime
from pathlib import Path

from fastapi import FastAPI
from starlette.testclient import TestClient

from server.conftest import HOST
from tauscope.server.auth.keys import KeyFile, Scope


def make_keys(data_folder: Path) -> dict[Scope, str]:
    """A key of each scope, for a service that begins later."""
    data_folder.mkdir(parents=True, exist_ok=True)
    now = datetime.now(UTC)
    return {scope: KeyFile(data_folder).add(scope.value, scope, now, None)[1] for scope in Scope}


def client_with(app: FastAPI, key: str | None) -> TestClient:
    """A client of an application that has begun."""
    client = TestClient(app, base_url=HOST, raise_server_exceptions=False)
    if key is not None:
        client.headers["authorization"] = f"Bearer {key}"
    return client
