"""Reach and opening test of finished bundles with an arm: python benchmarks/arm.py NAME=BUNDLE ... [-o benchmarks/arm.json]

A bundle is a zip or a folder that `r2c2r run` wrote. Each result is written to the file as soon as it is known; bundles already
in the file are skipped.
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

from r2c2r_core.export.stage import arm_to_json, reach_bundle


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bundles", nargs="+", metavar="NAME=BUNDLE")
    parser.add_argument("-o", type=Path, default=Path(__file__).with_suffix(".json"))
    parser.add_argument("--films", type=Path, help="output folder for films, sheets and maps")
    options = parser.parse_args()
    known = json.loads(options.o.read_text()) if options.o.is_file() else {"kitchens": {}}
    for name, _, path in (argument.partition("=") for argument in options.bundles):
        if name not in known["kitchens"]:
            known["kitchens"][name] = _tried(Path(path), options.films / name if options.films else None)
        known["all"] = {
            key: sum(kitchen[key] for kitchen in known["kitchens"].values())
            for key in ("joints", "in_reach", "opened", "places")
        }
        options.o.write_text(json.dumps(known, indent=1) + "\n")
        print(name, known["kitchens"][name])
    print(json.dumps(known["all"], indent=1))


def _tried(bundle: Path, films: Path | None) -> dict[str, Any]:
    started = time.process_time()
    found = arm_to_json(reach_bundle(bundle, films))
    opened = [grip for grip in found["grips"] if grip["passed"]]
    return {
        "joints": found["joints"],
        "in_reach": found["joints_in_reach"],
        "opened": found["joints_opened"],
        "places": len(found["places"]),
        "at_20_n": sum(grip["grip_n"] == 20.0 for grip in opened),
        "slip_mm": [round(1000 * grip["slip_m"], 1) for grip in opened],
        "force_n": [round(grip["force_n"]) for grip in opened],
        "failures": {grip["name"]: f"{grip['why']} (the {grip['blame']})" for grip in found["grips"] if not grip["passed"]},
        "cpu_s": round(time.process_time() - started, 1),
    }


if __name__ == "__main__":
    main()
