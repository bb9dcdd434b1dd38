"""Robot files with CiA 402 drives."""

import json
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from tauscope.robot import Robot
from tauscope_drivers.drive_block import DriveJoint

GEAR = 50.0
COUNTS_PER_TURN = 65_536
RATED_TORQUE_MNM = 400
"""Of the motors: three times as much, 60 Nm at the joint, is what a drive allows at most."""


def write_canopen_robot(source: Path, folder: Path, interface: str | None = None) -> Path:
    """A robot file in a folder, its joints driven by nodes 1, 2 … on an interface of SocketCAN.

    Without one, the bus hangs on the serial adapter ``port`` in that folder.
    """
    serial = {"interface": "slcan", "channel": str(folder / "port")}
    on_bus = serial if interface is None else {"interface": "socketcan", "channel": interface}
    yaml = YAML()
    document = yaml.load(source.read_text(encoding="utf-8"))
    for number, joint in enumerate(document["joints"], 1):
        bus = on_bus if number == 1 else {}
        joint["gear_ratio"] = GEAR
        joint["drive"] = {"node_id": number, "counts_per_turn": COUNTS_PER_TURN, "stop_policy": "hold", **bus}
    robot = folder / "robot.yaml"
    with robot.open("w", encoding="utf-8") as file:
        yaml.dump(document, file)
    return robot


def write_canopen_arm(
    arm: dict[str, Any], path: Path, bus: Path | str, *, knows_model: bool = True, **keys: Any
) -> Path:
    """The arm with a drive at every joint, with or without the truth about its links and friction.

    The bus is a serial adapter by its path, or an interface of SocketCAN by its name; keys are further ones of drives.
    """
    drives = [
        {"node_id": number, "counts_per_turn": COUNTS_PER_TURN, "stop_policy": "hold", **keys}
        for number in range(1, len(arm["joints"]) + 1)
    ]
    drives[0] |= {"interface": "slcan" if isinstance(bus, Path) else "socketcan", "channel": str(bus)}
    joints = [{**joint, "gear_ratio": GEAR, "drive": drive} for joint, drive in zip(arm["joints"], drives, strict=True)]
    told = {key: value for key, value in arm.items() if knows_model or key != "model"}
    path.write_text(json.dumps({**told, "joints": joints}), encoding="utf-8")
    return path


def drive_joints(robot: Robot) -> list[DriveJoint]:
    """The joints of such an arm, as the driver sees them."""
    return [DriveJoint(joint.name, joint.drive or {}, gear_ratio=GEAR) for joint in robot.joints]
