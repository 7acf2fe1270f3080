"""Success rate of the scripted policy over variants.

    python benchmarks/scripted.py VARIANTS --joint NAME ... --thing NAME ... [-n 100] [-o FILE]

VARIANTS is a folder that `r2c2r vary` wrote. Episode k takes variant k and seed k; the file is written after each episode, and
episodes already in it are not repeated. Needs the extra `r2c2r[gym]`.
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

import gymnasium

import r2c2r_core.gym  # noqa: F401  # registers the environments
from r2c2r_core.errors import BundleError
from r2c2r_core.gym.scripted import scripted_actions


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("variants", type=Path)
    parser.add_argument("--joint", action="append", default=[])
    parser.add_argument("--thing", action="append", default=[])
    parser.add_argument("-n", type=int, default=100)
    parser.add_argument("-o", type=Path, default=Path(__file__).with_suffix(".json"))
    options = parser.parse_args()
    known: dict[str, Any] = json.loads(options.o.read_text()) if options.o.is_file() else {}
    tasks = [("r2c2r/Open-v0", "joint", name) for name in options.joint]
    tasks += [("r2c2r/PickPlace-v0", "thing", name) for name in options.thing]
    for task, kind, name in tasks:
        if name not in known:
            known[name] = {"task": task, **_tried(gymnasium.make(task, bundle=options.variants, **{kind: name}), options.n)}
            options.o.write_text(json.dumps(known, indent=1) + "\n")
        print(name, known[name])


def _tried(env: gymnasium.Env, count: int) -> dict[str, Any]:
    solved, refused, started = 0, dict[int, str](), time.process_time()
    steps = list[int]()
    for number in range(count):
        try:
            _, info = env.reset(seed=number, options={"variant": f"{number:05d}"})
        except BundleError as error:
            refused[number] = str(error)
            continue
        steps.append(0)
        for action in scripted_actions(env.unwrapped):
            _, _, terminated, truncated, info = env.step(action)
            steps[-1] += 1
            if terminated or truncated:
                break
        solved += bool(info["success"])
    seconds = (time.process_time() - started) / count
    middle = sorted(steps)[len(steps) // 2] if steps else None
    return {
        "episodes": count,
        "solved": solved,
        "steps_median": middle,
        "refused": refused,
        "cpu_s_an_episode": round(seconds, 2),
    }


if __name__ == "__main__":
    main()
