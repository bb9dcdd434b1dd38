"""A process that owns a run, to be killed by tests: says which process moves the arm, then every state.

``python run_owner.py FOLDER`` carries out ``order.json`` beside the folder.
"""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tauscope.robot import read_robot
from tauscope.runtime.options import RunOrder
from tauscope.runtime.run_process import RunProcess


def say(event: Mapping[str, Any]) -> None:
    if event["event"] == "state":
        print("state", event["state"], flush=True)


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    order = RunOrder.model_validate_json((folder.parent.parent / "order.json").read_bytes())
    run = RunProcess(folder, order, read_robot(order.robot), report=say)
    print("control", run.pid, flush=True)
    print("ended", run.wait().state.value, flush=True)
