"""Tables generated at build time: all settings of a run, all options of all commands, all simulators."""

import argparse
import json
from collections.abc import Iterator
from dataclasses import Field, fields, is_dataclass
from pathlib import Path
from typing import Any

from r2c2r_core.tuning import modules_with_numbers, params_of

_BOUNDS = {"ge": "from {}", "gt": "above {}", "le": "to {}", "lt": "below {}"}
_SETTINGS, _COMMANDS = "<!-- every setting -->", "<!-- every command -->"
_SIMULATORS, _ENGINES = "<!-- every simulator -->", "<!-- every engine -->"
_RESULTS = Path(__file__).resolve().parents[1] / "benchmarks" / "engines.json"


def on_config(config: Any) -> Any:
    """Append the pages that the navigation does not list."""
    named = str(config["nav"])
    further = sorted(page.name for page in Path(config["docs_dir"]).glob("*.md") if page.name not in named)
    if further:
        config["nav"].append({"Further pages": further})
    return config


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Replace the page's markers by the generated tables."""
    for mark, made in ((_SETTINGS, tables), (_COMMANDS, commands), (_SIMULATORS, simulators), (_ENGINES, engines)):
        if mark in markdown:
            markdown = markdown.replace(mark, made())
    return markdown


def tables() -> str:
    """One table a stage, with the sections of its settings below it."""
    from r2c2r_core.config import ReconstructConfig

    config = ReconstructConfig()
    return "\n".join(line for stage in fields(config) for line in _section(getattr(config, stage.name), stage.name))


def commands() -> str:
    """A heading, a sentence and a table of options for each command, and for each of its own commands."""
    from r2c2r_core.cli import build_parser

    return "\n".join(line for parser in _commands_of(build_parser()) for line in _command(parser))


def simulators() -> str:
    """A heading, the installation and the code of each simulator's recipe."""
    from r2c2r_core.export.loaders import APART
    from r2c2r_core.export.simulators import recipes

    lines = []
    for recipe in recipes("kitchen", "drawer_1"):
        tested = (
            f"the certificate reads this file with {recipe.loader}" if recipe.loader else "not tested: needs its own system"
        )
        if recipe.loader in APART:
            tested += f" where `{APART[recipe.loader].variable}` names its Python"
        lines += [f"### {recipe.simulator}", "", f"`{recipe.install}`; {tested}.", ""]
        lines += [f"```{recipe.language}", recipe.code, "```", "", recipe.note, ""]
    return "\n".join(lines)


def engines() -> str:
    """A row for each engine of benchmarks/engines.json: bundles passed, joint values it does not keep, steps a second."""
    rows = json.loads(_RESULTS.read_text(encoding="utf-8"))
    lines = [
        "| engine | bundles passed | joint values not kept | steps/s, 1 world | steps/s, 256 worlds |",
        "|---|---|---|---|---|",
    ]
    for name in dict.fromkeys(name for row in rows.values() for name in row["loaders"]):
        said = [row["loaders"][name] for row in rows.values() if name in row["loaders"]]
        speeds = (_spread([entry["steps_per_s"].get(worlds) for entry in said]) for worlds in ("1", "256"))
        lost = next((part for entry in said if (part := entry["detail"].partition("it does not keep joint ")[2])), "")
        passed = sum(entry["state"] == "passed" for entry in said)
        lines.append(f"| {' | '.join([name, f'{passed} of {len(said)}', lost, *speeds])} |")
    return "\n".join(lines)


def _spread(values: list[float | None]) -> str:
    """Least to most of the values that are there, as whole numbers."""
    found = [value for value in values if value is not None]
    return f"{min(found):.0f}-{max(found):.0f}" if found else ""


def _commands_of(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    """Those of a parser, each followed by its own."""
    for action in parser._actions:  # argparse has no public way to its commands
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                yield command
                yield from _commands_of(command)


def _command(parser: argparse.ArgumentParser) -> list[str]:
    """Heading, meaning and options of one command; defaults are those of this machine, with its home folder as ~."""
    lines = [f"### {parser.prog}", "", parser.description or "", ""]
    listed = [action for action in parser._actions if action.help != argparse.SUPPRESS and "-h" not in action.option_strings]
    if listed:
        lines += ["| option | meaning |", "|---|---|"]
    for action in listed:
        names = ", ".join(action.option_strings) or str(action.metavar or action.dest)
        value = f" {action.metavar or action.dest.upper()}" if action.option_strings and action.nargs != 0 else ""
        default = "" if action.default is None else str(action.default).replace(str(Path.home()), "~")
        meaning = (action.help or "").replace("%(default)s", default)
        cells = (f"`{names}{value}`", meaning)
        lines.append(f"| {' | '.join(cell.replace('|', '&#124;') for cell in cells)} |")
    return [*lines, "", *(("```", parser.epilog, "```", "") if parser.epilog else ())]


def _section(config: Any, path: str) -> list[str]:
    """Heading, table and nested sections of one settings class."""
    nested = [field for field in fields(config) if is_dataclass(getattr(config, field.name))]
    rooms = [field.metadata["room"] for field in fields(config) if "room" in field.metadata]
    lines = [
        f"### {path}",
        "",
        *((type(config).__doc__ or "").split("\n\n")[:1]),
        "",
        "| setting | default | may be | meaning |",
    ]
    lines += ["|---|---|---|---|"]
    for field in fields(config):
        if field not in nested:
            cells = (f"`{field.name}`", f"`{getattr(config, field.name)!r}`", _allowed(field), field.metadata["description"])
            lines.append(f"| {' | '.join(cell.replace('|', '&#124;') for cell in cells)} |")
    further = [line for field in nested for line in _section(getattr(config, field.name), f"{path}.{field.name}")]
    numbers = [line for room in rooms for path in modules_with_numbers(room) for line in _numbers(path)]
    return [*lines, "", *numbers, *further]


def _numbers(path: str) -> list[str]:
    """Heading and table of the tuned numbers of one module."""
    room, _, module = path.partition(".")
    of = params_of(path)
    lines = [f"### {room}.params.{module}", "", *(of.__doc__ or "").split("\n\n")[:1], ""]
    lines += ["| number | default | unit | meaning | source |", "|---|---|---|---|---|"]
    for field in fields(of):
        extra = field.metadata["json_schema_extra"]
        cells = (f"`{field.name}`", _shown(field.default), extra["unit"], field.metadata["description"], extra["source"])
        lines.append(f"| {' | '.join(cell.replace('|', '&#124;') for cell in cells)} |")
    return [*lines, ""]


def _shown(value: Any) -> str:
    """To four places: an angle is written in degrees where it is set."""
    return ", ".join(f"{each:.4g}" for each in value) if isinstance(value, tuple) else f"{value:.4g}"


def _allowed(field: Field[Any]) -> str:
    """Its type, and its bounds where it has any."""
    bounds = (text.format(field.metadata[name]) for name, text in _BOUNDS.items() if name in field.metadata)
    kind = field.type.__name__ if isinstance(field.type, type) else str(field.type).replace("typing.", "")
    return ", ".join([kind, *bounds])
