"""Dockerfile, compose file, proxy and CAN network: read by their own programs where those are there, else as data."""

import configparser
import json
import re
import shutil
import subprocess
from ipaddress import ip_address, ip_network
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

from shared_data import REPOSITORY
from tauscope.cli.program import main
from tauscope.server.http.settings import Settings

DEPLOY = REPOSITORY / "deploy"
CONTAINER = DEPLOY / "container"


def compose_command() -> list[str] | None:
    """How compose is called here; None where it is not there."""
    plugin = ["docker", "compose"]
    if (
        shutil.which("docker")
        and subprocess.run([*plugin, "version"], check=False, capture_output=True).returncode == 0
    ):
        return plugin
    return None


@pytest.fixture(scope="module")
def compose() -> dict[str, Any]:
    return YAML(typ="safe", pure=True).load((CONTAINER / "compose.yaml").read_text(encoding="utf-8"))


@pytest.mark.system
@pytest.mark.skipif(compose_command() is None, reason="needs docker compose")
@pytest.mark.parametrize("profiles", [[], ["postgres"], ["dask"], ["postgres", "dask"]])
def test_compose_understands_the_file(profiles: list[str]) -> None:
    chosen = [word for profile in profiles for word in ("--profile", profile)]
    command = [*(compose_command() or []), "-f", str(CONTAINER / "compose.yaml"), *chosen, "config", "--format", "json"]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    expected = {"tauscope", "proxy"} | {"postgres"} & {*profiles}
    expected |= {"scheduler", "worker"} if "dask" in profiles else set()
    assert set(json.loads(done.stdout)["services"]) == expected


def test_only_the_proxy_is_reached_from_outside(compose: dict[str, Any]) -> None:
    assert {name for name, service in compose["services"].items() if "ports" in service} == {"proxy"}
    assert {name for name, service in compose["services"].items() if "outside" in service["networks"]} == {"proxy"}
    assert compose["networks"]["inside"]["internal"] is True


def test_who_starts_first_does_not_get_the_address_of_another(compose: dict[str, Any]) -> None:
    """Networks give the lowest free address to who asked for none, unless they are told where to begin."""
    (given,) = compose["networks"]["inside"]["ipam"]["config"]
    subnet, drawn = ip_network(given["subnet"]), ip_network(given["ip_range"])
    joined = [service["networks"] for service in compose["services"].values() if isinstance(service["networks"], dict)]
    fixed = [ip_address(networks["inside"]["ipv4_address"]) for networks in joined]
    assert len(set(fixed)) == 2
    assert all(address in subnet and address not in drawn for address in fixed)


def test_the_image_asks_only_the_service_how_it_is(compose: dict[str, Any]) -> None:
    for name, service in compose["services"].items():
        if service["image"] == "tauscope" and name != "tauscope":
            assert service["healthcheck"] == {"disable": True}, name


def test_containers_may_do_little(compose: dict[str, Any]) -> None:
    for name, service in compose["services"].items():
        assert service["security_opt"] == ["no-new-privileges:true"], name
        assert not service.get("privileged"), name
        if name != "postgres":  # it changes its user by itself when it starts
            assert (service["read_only"], service["cap_drop"]) == (True, ["ALL"]), name
        assert ":latest" not in service["image"], name


def test_no_secret_stands_in_the_files() -> None:
    for path in (path for path in DEPLOY.rglob("*") if path.is_file()):
        assert not re.search(r"(?i)(password|secret|token)\s*[:=]\s*['\"]?\w", path.read_text()), path


def test_the_image_is_built_in_two_stages_and_runs_as_nobody() -> None:
    lines = (CONTAINER / "Dockerfile").read_text(encoding="utf-8").splitlines()
    stages = [number for number, line in enumerate(lines) if line.startswith("FROM ")]
    assert len(stages) == 2
    last = lines[stages[1] :]
    assert "USER 10001" in last
    assert last.index("USER 10001") < next(n for n, line in enumerate(last) if line.startswith("CMD"))
    assert any("--require-hashes" in line for line in lines)
    assert not [line for line in lines if re.search(r"curl|wget|ADD ", line)]
    copied = [line.split()[1] for line in lines if line.startswith("COPY") and "--from" not in line]
    ignored = (CONTAINER / "Dockerfile.dockerignore").read_text().splitlines()
    for name in copied:
        assert (REPOSITORY / name).exists(), name
        assert f"!{name}" in ignored


def commands() -> list[list[str]]:
    """Every way in which the files start the service."""
    (cmd,) = re.findall(r"^CMD (\[.+\])$", (CONTAINER / "Dockerfile").read_text(), flags=re.MULTILINE)
    composed = YAML(typ="safe", pure=True).load((CONTAINER / "compose.yaml").read_text())["services"]["tauscope"]
    unit = (DEPLOY / "systemd" / "tauscope.service").read_text()
    (start,) = re.findall(r"^ExecStart=\S+/(tauscope .+)$", unit, flags=re.MULTILINE)
    named = composed["command"].replace("${TAUSCOPE_NAME:-localhost}", "localhost")
    return [json.loads(cmd), named.split(), start.split()]


@pytest.mark.parametrize(
    ("command", "data_folder"),
    list(zip(commands(), ["/var/lib/tauscope/data", "/var/lib/tauscope/data", "/var/lib/tauscope"], strict=True)),
    ids=["image", "compose", "systemd"],
)
def test_the_program_understands_how_it_is_started(
    command: list[str], data_folder: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[Settings] = []
    monkeypatch.setattr("tauscope.server.http.app.serve", lambda settings, _: seen.append(settings))
    program, *words = command
    assert program == "tauscope"
    assert main(words) == 0
    (settings,) = seen
    assert (str(settings.data_folder), settings.log_format) == (data_folder, "json")


def test_the_proxy_and_compose_agree(compose: dict[str, Any]) -> None:
    proxy, service = compose["services"]["proxy"], compose["services"]["tauscope"]
    assert f"--trusted-proxy {proxy['networks']['inside']['ipv4_address']}" in service["command"]
    text = (DEPLOY / "proxy" / "Caddyfile").read_text()
    assert "{$TAUSCOPE_UPSTREAM:tauscope:8000}" in text
    assert text.count("{") == text.count("}")
    assert f"max_size {Settings(data_folder=Path('x')).max_upload_bytes // 2**20}MiB" in text


@pytest.mark.system
@pytest.mark.skipif(shutil.which("caddy") is None, reason="needs caddy")
def test_caddy_understands_its_file() -> None:
    command = ["caddy", "validate", "--adapter", "caddyfile", "--config", str(DEPLOY / "proxy" / "Caddyfile")]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_the_can_network_names_rate_and_restart() -> None:
    parser = configparser.ConfigParser(strict=True)
    parser.read_string((DEPLOY / "network" / "80-tauscope-can.network").read_text())
    assert parser["Match"]["Name"] == "can0"
    assert re.fullmatch(r"\d+[kM]?", parser["CAN"]["BitRate"])
    assert parser["CAN"]["RestartSec"]
