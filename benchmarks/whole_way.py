"""A recording taken through `r2c2r run`, `check` and `evaluate`."""

import json
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from measure import Cost, run_measured

REPOSITORY = Path(__file__).resolve().parents[1]
CLI = [sys.executable, "-m", "r2c2r_core.cli"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """Results of the commands, and their cost."""

    cost: Cost
    certified: bool
    evaluation: dict[str, Any] | None  # output of `r2c2r evaluate --json`; None without a bundle
    doubted: frozenset[str] = frozenset()  # objects of the bundle with a finding of the certificate's likeness check
    present: frozenset[str] = frozenset()  # objects of the bundle


def whole_way(
    recording: Path,
    prompts: Path,
    truth: Path,
    work: Path,
    *,
    anew: bool = True,
    preset: str = "default",
    run_options: Sequence[str] = (),
) -> Outcome:
    """Run the commands; `work` keeps bundle.zip, run.log, certificate.json and evaluation.json.

    With `anew` it is emptied before; otherwise stages whose inputs and code are unchanged are read from it.
    """
    if anew:
        shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True, exist_ok=True)
    bundle, masks, answer = work / "bundle.zip", work / "masks", work / "evaluation.json"
    bundle.unlink(missing_ok=True)
    run = [*CLI, "run", str(recording), "--prompts", str(prompts), "-o", str(bundle), "--preset", preset, *run_options]
    cost = run_measured([*run, "--workdir", str(work / "work"), "--masks", str(masks)], cwd=REPOSITORY, log=work / "run.log")
    if not bundle.exists():
        print(f"{work.name}: no bundle (exit {cost.exit_code}); see {work / 'run.log'}", file=sys.stderr)
        return Outcome(cost=cost, certified=False, evaluation=None)
    certified = _said("check", str(bundle), "--json", str(work / "certificate.json")).returncode == 0
    done = _said("evaluate", str(bundle), "--truth", str(truth), "--masks", str(masks), "--json", str(answer))
    if done.returncode != 0:
        print(f"{work.name}: {done.stderr.strip()}", file=sys.stderr)
        return Outcome(cost=cost, certified=certified, evaluation=None)
    (work / "evaluation.txt").write_text(done.stdout, encoding="utf-8")
    likeness = _read(work / "certificate.json")["likeness"]
    with zipfile.ZipFile(bundle) as archive:
        manifest = json.loads(archive.read("manifest.json"))
    return Outcome(
        cost=cost,
        certified=certified,
        evaluation=_read(answer),
        doubted=frozenset(doubt["object"] for doubt in likeness["doubts"]),
        present=frozenset(item["name"] for item in manifest["objects"]),
    )


def _read(path: Path) -> Any:
    return json.loads(path.read_text(encoding="utf-8"))


def _said(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([*CLI, *words], cwd=REPOSITORY, capture_output=True, text=True, check=False)
