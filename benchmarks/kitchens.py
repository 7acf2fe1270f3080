"""Kitchens of the accuracy guard, and the commands that draw them."""

import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from recordings import recording_in, write_masks_by_name
from whole_way import CLI, REPOSITORY

from r2c2r_core.synthetic.as_filmed import film_as_real
from r2c2r_core.synthetic.choices import STYLES

_SCRIPTS = Path(__file__).resolve().parent
_WITH_LZFSE = (  # the generator imports the codec under another package's name
    "import lzfse, runpy, sys; sys.modules['liblzfse'] = lzfse; del sys.argv[0]; "
    "runpy.run_path(sys.argv[0], run_name='__main__')"
)
AS_FILMED = ("--register-depth",)
_OPENED_FILM = ("--frames", "120", "--size", "480x360")


class Generators(NamedTuple):
    """Third-party files that some kitchens are drawn from."""

    second: Path | None  # make_kitchen.py
    franka: Path | None  # the gymnasium-robotics wheel, 1.4.2 or later


@dataclass(frozen=True, slots=True, kw_only=True)
class GuardedKitchen:
    """Commands and options to draw, click and measure a kitchen."""

    command: Callable[[Generators, str], list[str | Path | None]]  # from the generators and the target folder
    random_clicks: bool = False  # instead of those of its prompts.json
    edges_only: bool = False  # only the edges of fronts, from the segmenter alone
    run_options: tuple[str, ...] = ()  # of `r2c2r run`
    finish: Callable[[Path], None] | None = None  # changes the drawn folder


def _own(*options: str) -> Callable[[Generators, str], list[str | Path | None]]:
    return lambda _, out: [*CLI, "sample", out, *options]


def _second(seed: int) -> GuardedKitchen:
    options = ("--seed", str(seed), "--frames", "120")
    return GuardedKitchen(
        command=lambda by, out: [sys.executable, "-c", _WITH_LZFSE, by.second, out, *options], random_clicks=True
    )


def _second_as_filmed(seed: int) -> GuardedKitchen:
    def finish(folder: Path) -> None:
        write_masks_by_name(folder)
        film_as_real(recording_in(folder), seed)

    return replace(_second(seed), run_options=AS_FILMED, finish=finish)


def _second_opened(seed: int) -> GuardedKitchen:
    script, options = _SCRIPTS / "second_opened.py", ("--seed", str(seed), *_OPENED_FILM)
    return GuardedKitchen(command=lambda by, out: [sys.executable, script, by.second, out, *options])


KITCHENS: dict[str, GuardedKitchen] = {
    **{f"sample-{seed}": GuardedKitchen(command=_own("--seed", str(seed))) for seed in range(5)},
    **{f"second-{seed}": _second(seed) for seed in range(100, 105)},
    "franka": GuardedKitchen(
        command=lambda by, out: [sys.executable, _SCRIPTS / "franka.py", by.franka, out], random_clicks=True
    ),
    **{
        f"as-filmed-{seed}": GuardedKitchen(command=_own("--as-filmed", "--seed", str(seed)), run_options=AS_FILMED)
        for seed in (20, 21)
    },
    **{f"as-filmed-second-{seed}": _second_as_filmed(seed) for seed in (105, 106)},
    "opened-ours-21": GuardedKitchen(command=_own("--opened", "--seed", "21", "--layout", "straight", *_OPENED_FILM)),
    "opened-second-101": _second_opened(101),
    **{
        f"{style}-{seed}": GuardedKitchen(
            command=_own("--style", style, "--seed", str(seed), "--frames", "60", "--size", "640x480"), edges_only=True
        )
        for style in STYLES
        for seed in (120, 121)
    },
}
FAST = ("sample-0", "sample-3", "second-101", "second-103", "franka", "opened-ours-21")


def drawn(name: str, workdir: Path, generators: Generators) -> Path | None:
    """The kitchen's folder, drawn if missing; None if its generator is not given."""
    folder, unfinished = workdir / name, workdir / f"unfinished-{name}"
    if folder.exists():
        return folder
    command = KITCHENS[name].command(generators, str(unfinished))
    if None in command:
        return None
    shutil.rmtree(unfinished, ignore_errors=True)
    workdir.mkdir(parents=True, exist_ok=True)
    subprocess.run([str(word) for word in command], cwd=REPOSITORY, check=True, stdout=subprocess.DEVNULL)
    if (finish := KITCHENS[name].finish) is not None:
        finish(unfinished)
    unfinished.rename(folder)
    return folder
