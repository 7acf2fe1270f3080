"""`r2c2r check`."""

import argparse
from pathlib import Path

from r2c2r_core.commands.options import Parsers, add_command, add_json, add_strict, existing, write_json
from r2c2r_core.errors import InputError
from r2c2r_core.terminal import arm_text, certificate_text, gripper_text, show_progress


def add(parsers: Parsers) -> None:
    """The command and its options."""
    added = add_command(parsers, "check", check)
    added.add_argument("bundle", type=Path, help="bundle, zipped or as a folder")
    added.add_argument(
        "--gripper", action="store_true", help="let a friction gripper open every joint and move every free object"
    )
    added.add_argument(
        "--arm",
        action="store_true",
        help="let a Franka Panda open every joint within its reach, and print its base positions",
    )
    added.add_argument(
        "--films",
        type=Path,
        metavar="DIR",
        help="with --gripper or --arm: folder for a film and a contact sheet of each trial (the arm's, with a map, in DIR/arm)",
    )
    add_strict(added)
    add_json(added)


def check(options: argparse.Namespace) -> int:
    """Check a bundle: lint and simulation certificate; with --gripper or --arm, also whether a robot can open its joints."""
    from r2c2r_core.export.stage import (
        arm_to_json,
        certificate_to_json,
        check_bundle,
        grip_bundle,
        gripper_to_json,
        reach_bundle,
    )

    if options.films and not (options.gripper or options.arm):
        raise InputError("--films: there is nothing to film without --gripper or --arm", hint="add --gripper or --arm")
    bundle, films = existing(options.bundle), options.films
    with show_progress() as progress:
        certificate = check_bundle(bundle, progress=progress.for_stage("check"))
        gripped = grip_bundle(bundle, films, progress=progress.for_stage("gripper")) if options.gripper else None
        arm = reach_bundle(bundle, films and films / "arm", progress=progress.for_stage("arm")) if options.arm else None
    found = certificate_to_json(certificate)
    print(certificate_text(certificate))
    if gripped is not None:
        found["gripper"] = gripper_to_json(gripped)
        print(f"\n{gripper_text(gripped)}")
    if arm is not None:
        found["arm"] = arm_to_json(arm)
        print(f"\n{arm_text(arm)}")
    if options.json:
        write_json(options.json, found)
    alike = not options.strict or certificate.likeness.state == "passed"
    return 0 if certificate.passed and alike and (gripped is None or gripped.passed) else 1
