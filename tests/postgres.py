"""A PostgreSQL server of the tests' own: Debian's package, started in a temporary folder, reached by a socket only."""

import os
import pwd
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path

import psycopg

_USER = "postgres"
_numbers = count(1)


def program_folder() -> Path | None:
    """Where the server's programs lie; None where it is not installed."""
    folders = sorted(Path("/usr/lib/postgresql").glob("*/bin"), key=lambda folder: float(folder.parent.name))
    return folders[-1] if folders and (folders[-1] / "pg_ctl").exists() else None


class Postgres:
    """A server that runs; every database that it gives out is new."""

    def __init__(self, socket: Path) -> None:
        self._socket = socket

    def address(self, name: str = "postgres") -> str:
        return f"postgresql://{_USER}@/{name}?host={self._socket}"

    def new_database(self) -> str:
        """The URL of a database in which there is nothing yet."""
        name = f"t{next(_numbers)}_{os.getpid()}"
        with psycopg.connect(self.address(), autocommit=True) as connection:
            connection.execute(f"CREATE DATABASE {name}".encode())
        return self.address(name)


@contextmanager
def running_postgres() -> Iterator[Postgres]:
    """Start a server, and end it; its files are gone afterwards. It refuses to run as root: then as user postgres."""
    programs = program_folder()
    assert programs is not None
    folder = Path(tempfile.mkdtemp(prefix="tauscope-pg-", dir="/tmp"))  # a socket's path has to be short
    user = _USER if os.geteuid() == 0 else None
    if user is not None:
        owner = pwd.getpwnam(user)
        os.chown(folder, owner.pw_uid, owner.pw_gid)

    def call(program: str, *words: str) -> None:
        command = [str(programs / program), *words]
        subprocess.run(command, check=True, user=user, cwd=folder, stdout=subprocess.DEVNULL, timeout=60)

    data = str(folder / "data")
    options = f"-c listen_addresses='' -c unix_socket_directories={folder} -c fsync=off -c max_connections=50"
    try:
        call("initdb", "-D", data, "-U", _USER, "-A", "trust", "-E", "UTF8", "--no-sync")
        call("pg_ctl", "-D", data, "-w", "-l", str(folder / "log"), "-o", options, "start")
        try:
            yield Postgres(folder)
        finally:
            call("pg_ctl", "-D", data, "-w", "-m", "immediate", "stop")
    finally:
        shutil.rmtree(folder, ignore_errors=True)
