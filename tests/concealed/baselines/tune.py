"""Find the thresholds with which the baselines do best on development trials: `python -m concealed.baselines.tune`."""

import argparse
import json
from pathlib import Path

from concealed.baselines.claims import BASELINES, TUNED, Rankings, best_threshold
from concealed.baselines.columns import ground
from concealed.baselines.ranking import rankings
from concealed.generator.case import SERIES
from concealed.sealing.sealed import made
from concealed.sealing.truth import truth_of

LOOKED_AT = ("sound", "moderate", "strong")


def main() -> None:
    """Rank development trials, and write the best thresholds."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=30, help="trials of each series")
    parser.add_argument("--first-seed", type=int, default=7000)
    parser.add_argument("--kept", type=Path, default=Path("rankings.jsonl"), help="rankings, one trial a line")
    asked = parser.parse_args()
    asked.kept.touch()
    lines = [json.loads(line) for line in asked.kept.read_text(encoding="utf-8").splitlines()]
    trials: dict[tuple[str, int], tuple[Rankings, list[list[str]]]] = {
        (each["series"], each["seed"]): (each["rankings"], each["labels"]) for each in lines
    }
    for number in range(asked.count):
        for series in LOOKED_AT:
            seed = asked.first_seed + number
            if (series, seed) in trials:
                continue
            case, trial = made(series, seed)
            told = rankings(ground(trial.robot, trial.train))
            labels = [hidden.labels for hidden in truth_of(trial, case).hidden]
            trials[series, seed] = told, labels
            with asked.kept.open("a", encoding="utf-8") as file:
                file.write(json.dumps({"series": series, "seed": seed, "rankings": told, "labels": labels}) + "\n")
            print(case.name, labels, told["bic"][0], flush=True)
    count = sum(1 for series, _ in trials if not SERIES[series].count)
    words = [f"# Tuned on {len(trials)} development trials, {count} of them sound: seeds {asked.first_seed} and on of"]
    words += [
        f"# {', '.join(LOOKED_AT)}, by `python -m concealed.baselines.tune`; beside each the balanced accuracy there."
    ]
    for baseline in BASELINES:
        threshold, score = best_threshold(list(trials.values()), baseline)
        words.append(f"{baseline}: {threshold:.4g} # {score:.3f}")
    TUNED.write_text("\n".join(words) + "\n", encoding="utf-8")
    print(TUNED.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
