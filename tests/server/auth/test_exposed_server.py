"""The program itself at an address that others can reach: TLS, keys, and a key that is revoked while it runs."""

import re
import shutil
import ssl
import subprocess
import sys
from pathlib import Path

import httpx2
import pytest

from server.queue.waiting import wait_until
from shared_data import REPOSITORY

pytestmark = [
    pytest.mark.system,
    pytest.mark.skipif(shutil.which("openssl") is None, reason="needs openssl, which makes the certificate"),
]
PROGRAM = [sys.executable, "-m", "tauscope.cli"]


def make_certificate(folder: Path) -> tuple[Path, Path]:
    """A certificate that vouches for itself, and its key."""
    certificate, key = folder / "cert.pem", folder / "key.pem"
    subject = ["-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1"]
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", *subject]
    subprocess.run([*command, "-keyout", key, "-out", certificate], check=True, capture_output=True)
    return certificate, key


def run(*arguments: str) -> str:
    """What the program prints."""
    return subprocess.run([*PROGRAM, *arguments], cwd=REPOSITORY, check=True, capture_output=True, text=True).stdout


def test_tls_keys_and_revocation(tmp_path: Path) -> None:
    certificate, tls_key = make_certificate(tmp_path)
    data = ["--data", str(tmp_path / "data")]
    key = run("key", "add", "ann", *data).strip()
    tls = ["--tls-certificate", str(certificate), "--tls-key", str(tls_key)]
    serve = [*PROGRAM, "serve", "--host", "0.0.0.0", "--port", "0", *tls, *data]
    with subprocess.Popen(serve, cwd=REPOSITORY, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            found = re.search(r"https://0\.0\.0\.0:(\d+)", process.stdout.readline())
            assert found is not None
            context = ssl.create_default_context(cafile=certificate)
            url = f"https://127.0.0.1:{found[1]}"
            with httpx2.Client(base_url=url, verify=context, timeout=30) as client:
                assert client.get("/healthz").status_code == 200
                assert client.get("/api/v1/runs").status_code == 401
                assert client.get("/healthz", headers={"host": "evil.example"}).status_code == 400
                client.headers["authorization"] = f"Bearer {key}"
                assert client.get("/api/v1/runs").json() == {"runs": [], "next": None}
                subprocess.run(
                    [*PROGRAM, "key", "revoke", "ann", *data], cwd=REPOSITORY, check=True, capture_output=True
                )
                wait_until(lambda: client.get("/api/v1/runs").status_code == 401)
            with pytest.raises(httpx2.HTTPError):
                httpx2.get(f"http://127.0.0.1:{found[1]}/healthz")
        finally:
            process.terminate()
            out, err = process.communicate(timeout=60)
    assert key not in out + err
    assert "Traceback" not in err
