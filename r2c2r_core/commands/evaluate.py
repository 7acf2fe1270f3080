"""`r2c2r evaluate`."""

import argparse
from pathlib import Path

from r2c2r_core.commands.options import Parsers, add_command, add_json, existing, write_json


def add(parsers: Parsers) -> None:
    """The command and its options."""
    added = add_command(parsers, "evaluate", evaluate)
    added.add_argument("bundle", type=Path, help="a bundle (zip or folder), or a dataset's folder")
    added.add_argument("--truth", type=Path, required=True)
    added.add_argument("--masks", type=Path, help="the folder that run --masks wrote")
    add_json(added)


def evaluate(options: argparse.Namespace) -> int:
    """The metric set against truth: of a bundle, or of a dataset that `r2c2r dataset` wrote (its masks and aligned meshes)."""
    from r2c2r_core.evaluate.dataset import evaluate_dataset, is_dataset
    from r2c2r_core.evaluate.stage import evaluate_bundle

    bundle, truth = existing(options.bundle), existing(options.truth)
    dataset = is_dataset(bundle)
    evaluation = evaluate_dataset(bundle, truth) if dataset else evaluate_bundle(bundle, truth, masks=options.masks)
    if options.json:
        write_json(options.json, evaluation.to_json())
    print(evaluation.to_text())
    return 0
