"""What a test has a fresh installation do, with nothing but what is installed: `python - WHAT [KEY [JOB]] < errand.py`.

It fails where something goes wrong.
"""

import sys
from pathlib import Path
from urllib.request import urlopen

from tauscope.client import Client
from tauscope.server.http.analyses import IdentificationAnswer

FILES = Path("/errand")
PAGES = ("", "docs", "docs/errors/recording", "docs/how-to/let-others-in", "healthz", "readyz")


def pages() -> None:
    """The page, its documentation, and what tells others how the service is."""
    for page in PAGES:
        with urlopen(f"http://127.0.0.1:8000/{page}", timeout=30) as answer:
            assert answer.read(), page


def identify(client: Client) -> IdentificationAnswer:
    """Recordings in; every library that computes has to be there."""
    return client.identify(FILES / "arm.yaml", [FILES / "recording.csv"])


def follow(client: Client, job: IdentificationAnswer) -> None:
    """Parameters out."""
    job = client.wait(job, timeout_s=240)
    assert str(job.state) == "succeeded", job


def hand_in(client: Client) -> None:
    """An identification that nobody is there to do; printed for `follow`."""
    job = identify(client)
    try:
        job = client.wait(job, timeout_s=3)
    except TimeoutError:
        print(job.model_dump_json(by_alias=True))
    else:
        raise AssertionError(f"somebody did it: {job}")


def move(client: Client) -> None:
    """A run of the simulated arm: a control process, and MuJoCo."""
    with client.lease("paper-arm", ttl_s=60) as lease:
        client.arm(lease)
        start = {"start": [0.0, 0.6, 0.6]}  # of the motion
        run = client.run(FILES / "arm.yaml", lease, FILES / "motion.json", backend=start)
        run = client.wait(run, timeout_s=120, lease=lease)
    assert str(run.state) == "finished", run


what, key, job = [*sys.argv[1:], "", ""][:3]
client = Client(key=key or None)
match what:
    case "pages":
        pages()
    case "identify":
        follow(client, identify(client))
    case "hand-in":
        hand_in(client)
    case "follow":
        follow(client, IdentificationAnswer.model_validate_json(job))
    case "move":
        move(client)
    case _:
        raise AssertionError(what)
