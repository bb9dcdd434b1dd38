"""How the service is set up."""

import ipaddress
import os
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, SecretStr

from tauscope.runtime.drivers import DEFAULT_BACKEND, BackendName
from tauscope.server.store.data_folder import RECORDINGS, ItemKind
from tauscope.server.store.database.database import FILE_NAME

MEBIBYTE = 2**20


class Settings(BaseModel):
    """What the operator decides, and the bounds that keep one request from harming the others."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    data_folder: Path = Field(description="holds everything that is kept")
    database: SecretStr | None = Field(default=None, description="URL of PostgreSQL; None: SQLite in the data folder")
    host: str = Field(default="127.0.0.1", description="address to listen at")
    port: int = Field(default=8000, ge=0, le=65535, description="port to listen at; 0 takes any free one")
    max_upload_bytes: int = Field(default=256 * MEBIBYTE, gt=0, description="largest body of a request [bytes]")
    max_bytes_per_day: int = Field(default=20 * 1024 * MEBIBYTE, gt=0, description="upload quota of a key")
    max_document_bytes: int = Field(default=4 * MEBIBYTE, gt=0, description="largest JSON body or part [bytes]")
    max_recordings: int = Field(default=100, gt=0, description="most recordings of one request")
    max_waiting: int = Field(default=100, gt=0, description="most jobs that wait")
    workers: int = Field(default=1, gt=0, description="jobs that are worked on at a time, a process each")
    reading_timeout_s: float = Field(default=60.0, gt=0, description="longest time to read a file [s]")
    reading_memory_bytes: int = Field(default=2048 * MEBIBYTE, gt=0, description="memory of a process that reads files")
    job_timeout_s: float = Field(default=4 * 3600.0, gt=0, description="how long the work of a job may take [s]")
    max_jobs_per_caller: int = Field(default=50, gt=0, description="jobs of one caller that have not ended")
    max_arms: int = Field(default=4, gt=0, description="arms that may move at a time, a control process each")
    fires_schedules: bool = Field(default=True, description="whether what schedules repeat is started when it is due")
    backend: BackendName = Field(default=DEFAULT_BACKEND, description="what moves the arm unless a request says")
    sim_time: Literal["virtual", "real"] = Field(default="virtual", description="default clock of the simulated arm")
    sim_socket: Path | None = Field(default=None, description="of a running simulated arm; None: one a run")

    require_lease: bool = Field(default=False, description="whether an arm moves by a lease only; with keys: always")
    prune_older_than_days: float | None = Field(default=None, ge=0, description="age at which ended items are removed")
    prune_kinds: tuple[ItemKind, ...] = Field(default=(), description="kinds that are removed; empty: all")
    prune_recordings: bool = Field(default=False, description="whether unused recordings are removed, too")
    names: tuple[str, ...] = Field(default=(), description="further host names by which the service may be called")
    requests_per_s: float | None = Field(default=None, gt=0, description="rate limit; None: 200 with keys, else none")
    tls_certificate: Path | None = Field(default=None, description="PEM file of the certificate; null: plain HTTP")
    tls_key: Path | None = Field(default=None, description="PEM file of the certificate's private key")
    log_format: Literal["text", "json"] = Field(default="text", description="json: one object a line, with requests")
    trusted_proxies: tuple[str, ...] = Field(default=(), description="proxies whose client addresses are trusted")

    @property
    def database_address(self) -> Path | str:
        """The database, as `Database` takes it."""
        return self.data_folder / FILE_NAME if self.database is None else self.database.get_secret_value()

    @property
    def recordings_folder(self) -> Path:
        return self.data_folder / RECORDINGS

    @property
    def is_local(self) -> bool:
        return is_loopback(self.host)

    def answers_for(self, name: str | None) -> bool:
        """Whether a host names this service; a name that only resolves here (DNS rebinding) does not."""
        own = {"localhost", "127.0.0.1", "::1", self.host.lower(), *(other.lower() for other in self.names)}
        # No page of somebody else's can have an address of ours for its name: addresses are not rebound.
        return name in own or (not self.is_local and name is not None and _parse_address(name) is not None)


def is_loopback(host: str) -> bool:
    address = _parse_address(host)
    return host.lower() == "localhost" or (address is not None and address.is_loopback)


def _parse_address(name: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        return ipaddress.ip_address(name.strip("[]"))
    except ValueError:
        return None


def default_data_folder() -> Path:
    """Where data are kept when the operator names no folder: tauscope/ below $XDG_DATA_HOME or ~/.local/share."""
    base = os.environ.get("XDG_DATA_HOME", "")
    return (Path(base) if os.path.isabs(base) else Path.home() / ".local" / "share") / "tauscope"
