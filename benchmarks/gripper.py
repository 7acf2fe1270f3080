"""Opening test of finished bundles with a gripper: python benchmarks/gripper.py NAME=BUNDLE ... [-o benchmarks/gripper.json]

A bundle is a zip or a folder that `r2c2r run` wrote. Each result is written to the file as soon as it is known; bundles already
in the file are skipped.
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

from r2c2r_core.export.stage import grip_bundle, gripper_to_json


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bundles", nargs="+", metavar="NAME=BUNDLE")
    parser.add_argument("-o", type=Path, default=Path(__file__).with_suffix(".json"))
    parser.add_argument("--films", type=Path, help="output folder for films and sheets")
    options = parser.parse_args()
    known = json.loads(options.o.read_text()) if options.o.is_file() else {"kitchens": {}}
    for name, _, path in (argument.partition("=") for argument in options.bundles):
        if name not in known["kitchens"]:
            known["kitchens"][name] = _tried(Path(path), options.films / name if options.films else None)
        known["all"] = _together(known["kitchens"])
        options.o.write_text(json.dumps(known, indent=1) + "\n")
        print(name, known["kitchens"][name]["opened"], "of", known["kitchens"][name]["joints"])
    print(json.dumps(known["all"], indent=1))


def _tried(bundle: Path, films: Path | None) -> dict[str, Any]:
    started = time.process_time()
    found = gripper_to_json(grip_bundle(bundle, films))
    grips = found["grips"]
    opened = [grip for grip in grips if grip["kind"] == "joint" and grip["passed"]]
    return {
        "joints": found["joints"],
        "opened": found["joints_opened"],
        "things": found["things"],
        "moved": found["things_moved"],
        "at_20_n": sum(grip["grip_n"] == 20.0 for grip in opened),
        "methods": {
            method: sum(grip["method"] == method for grip in grips) for method in sorted({g["method"] or "none" for g in grips})
        },
        "slip_mm": [round(1000 * grip["slip_m"], 1) for grip in opened],
        "force_n": [grip["force_n"] for grip in opened],
        "failures": {grip["name"]: f"{grip['why']} (the {grip['blame']})" for grip in grips if not grip["passed"]},
        "cpu_s": round(time.process_time() - started, 1),
    }


def _together(kitchens: dict[str, Any]) -> dict[str, Any]:
    sums = {
        key: sum(kitchen[key] for kitchen in kitchens.values()) for key in ("joints", "opened", "things", "moved", "at_20_n")
    }
    slips = sorted(slip for kitchen in kitchens.values() for slip in kitchen["slip_mm"])
    forces = sorted(force for kitchen in kitchens.values() for force in kitchen["force_n"])
    return {
        **sums,
        "share_opened": round(sums["opened"] / max(sums["joints"], 1), 3),
        "slip_mm_median_and_most": [slips[len(slips) // 2], slips[-1]] if slips else None,
        "force_n_median_and_most": [round(forces[len(forces) // 2]), round(forces[-1])] if forces else None,
        "cpu_s_a_joint_or_thing": round(
            sum(kitchen["cpu_s"] for kitchen in kitchens.values()) / max(sums["joints"] + sums["things"], 1), 2
        ),
    }


if __name__ == "__main__":
    main()
