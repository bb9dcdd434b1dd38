"""Robot files with CiA 402 drives."""

from pathlib import Path

from ruamel.yaml import YAML

GEAR = 50.0
COUNTS_PER_TURN = 65_536
RATED_TORQUE_MNM = 400
"""Of the motors: three times as much, 60 Nm at the joint, is what a drive allows at most."""


def write_canopen_robot(source: Path, folder: Path) -> Path:
    """A robot file in a folder, its joints driven by nodes 1, 2 … behind the serial adapter ``port`` in that folder."""
    yaml = YAML()
    document = yaml.load(source.read_text(encoding="utf-8"))
    for number, joint in enumerate(document["joints"], 1):
        bus = {"interface": "slcan", "channel": str(folder / "port")} if number == 1 else {}
        joint["gear_ratio"] = GEAR
        joint["drive"] = {"node_id": number, "counts_per_turn": COUNTS_PER_TURN, "stop_policy": "hold", **bus}
    robot = folder / "robot.yaml"
    with robot.open("w", encoding="utf-8") as file:
        yaml.dump(document, file)
    return robot
