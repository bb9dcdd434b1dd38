"""How the service is set up."""

import ipaddress
import os
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from service.errors import TauscopeError

MEBIBYTE = 2**20


class Settings(BaseModel):
    """What the operator decides, and the bounds that keep one request from harming the others."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    data_folder: Path = Field(description="holds everything that is kept")
    host: str = Field(default="127.0.0.1", description="address to listen at")
    port: int = Field(default=8000, ge=0, le=65535, description="port to listen at; 0 takes any free one")
    max_upload_bytes: int = Field(default=256 * MEBIBYTE, gt=0, description="largest body of a request [bytes]")
    max_document_bytes: int = Field(default=4 * MEBIBYTE, gt=0, description="largest JSON body or part [bytes]")
    max_recordings: int = Field(default=100, gt=0, description="most recordings of one request")
    max_waiting: int = Field(default=100, gt=0, description="most jobs that wait")
    workers: int = Field(default=1, gt=0, description="jobs that are worked on at a time, a process each")
    max_arms: int = Field(default=4, gt=0, description="arms that may move at a time, a control process each")
    backend: Literal["sim", "dynamixel", "canopen"] = Field(
        default="sim", description="what moves the arm where a request names no backend"
    )
    sim_time: Literal["virtual", "real"] = Field(
        default="virtual", description="of the simulated arm, where a request does not say"
    )
    sim_socket: Path | None = Field(
        default=None,
        description="where a simulated arm that runs by the clock listens; one is started for each run where None",
    )

    @property
    def recordings_folder(self) -> Path:
        """Recordings that requests may name; an operator may put files here."""
        return self.data_folder / "recordings"

    @property
    def identifications_folder(self) -> Path:
        """Identifications, each a folder."""
        return self.data_folder / "identifications"

    @property
    def diagnoses_folder(self) -> Path:
        """Diagnoses, each a folder."""
        return self.data_folder / "diagnoses"

    @property
    def excitations_folder(self) -> Path:
        """Designed motions, each a folder."""
        return self.data_folder / "excitations"

    @property
    def runs_folder(self) -> Path:
        """Runs, each a folder."""
        return self.data_folder / "runs"

    @property
    def campaigns_folder(self) -> Path:
        """Campaigns, each a folder."""
        return self.data_folder / "campaigns"

    @property
    def allowed_hosts(self) -> frozenset[str]:
        """Names by which a browser may call this service: a page of another name that leads here is turned away."""
        return frozenset({"localhost", "127.0.0.1", "::1", self.host.lower()})

    def require_loopback(self) -> None:
        """Refuse an address that others can reach: there is no authentication yet.

        Raises
        ------
        TauscopeError
            if `host` is not a loopback address
        """
        if not is_loopback(self.host):
            hint = "listen at 127.0.0.1 and let others in through an SSH tunnel"
            raise TauscopeError(f"host {self.host!r}: others could reach it, and there are no users yet; {hint}")


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach an address.

    Parameters
    ----------
    host : str
        name or address
    """
    if host.lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


def default_data_folder() -> Path:
    """Where data are kept when the operator names no folder: tauscope/ below $XDG_DATA_HOME or ~/.local/share."""
    base = os.environ.get("XDG_DATA_HOME", "")
    return (Path(base) if os.path.isabs(base) else Path.home() / ".local" / "share") / "tauscope"
