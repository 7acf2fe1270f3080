"""`r2c2r evaluate`."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from r2c2r_core.commands.options import Parsers, add_command, add_json, existing, write_json
from r2c2r_core.errors import InputError

if TYPE_CHECKING:
    from r2c2r_core.evaluate.stage import Evaluation


def add(parsers: Parsers) -> None:
    """The command and its options."""
    added = add_command(parsers, "evaluate", evaluate)
    added.add_argument("bundle", type=Path, help="bundle (zip or folder), or the folder of a dataset")
    against = added.add_mutually_exclusive_group(required=True)
    against.add_argument("--truth", type=Path, help="truth.json of the recording")
    against.add_argument("--benchmark", nargs=2, metavar=("NAME", "DIR"), help="truth of a public data set: arti4d SEQUENCE")
    added.add_argument("--masks", type=Path, help="folder written by r2c2r run --masks")
    add_json(added)


def evaluate(options: argparse.Namespace) -> int:
    """Measure a bundle, or the masks and aligned meshes of a dataset by `r2c2r dataset`, against ground truth."""
    from r2c2r_core.evaluate.dataset import evaluate_dataset, is_dataset
    from r2c2r_core.evaluate.stage import evaluate_bundle

    bundle = existing(options.bundle)
    if options.benchmark is not None:
        evaluation = _against(bundle, *options.benchmark)
    else:
        truth, dataset = existing(options.truth), is_dataset(bundle)
        evaluation = evaluate_dataset(bundle, truth) if dataset else evaluate_bundle(bundle, truth, masks=options.masks)
    if options.json:
        write_json(options.json, evaluation.to_json())
    print(evaluation.to_text())
    return 0


def _against(bundle: Path, name: str, folder: str) -> "Evaluation":
    """Evaluation of a bundle against the truth of a data set."""
    from r2c2r_core.evaluate.arti4d import evaluate_arti4d

    if name != "arti4d":
        raise InputError(f"--benchmark {name}: unknown benchmark", hint="choose arti4d")
    return evaluate_arti4d(bundle, existing(Path(folder)))
