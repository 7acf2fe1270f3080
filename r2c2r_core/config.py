"""ReconstructConfig: one frozen dataclass per stage, each declared in its stage; --config reads it from JSON."""

import json
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from r2c2r_core.align.stage import AlignConfig
from r2c2r_core.errors import InputError
from r2c2r_core.export.stage import ExportConfig
from r2c2r_core.generate.stage import GenerateConfig
from r2c2r_core.ingest.stage import IngestConfig
from r2c2r_core.segment.stage import SegmentConfig
from r2c2r_core.synthesize.stage import SynthesizeConfig
from r2c2r_core.warp.stage import WarpConfig


@dataclass(frozen=True, slots=True, kw_only=True)
class ReconstructConfig:
    """Every setting of a run, by stage."""

    ingest: IngestConfig = field(default_factory=IngestConfig)
    segment: SegmentConfig = field(default_factory=SegmentConfig)
    generate: GenerateConfig = field(default_factory=GenerateConfig)
    align: AlignConfig = field(default_factory=AlignConfig)
    synthesize: SynthesizeConfig = field(default_factory=SynthesizeConfig)
    warp: WarpConfig = field(default_factory=WarpConfig)
    export: ExportConfig = field(default_factory=ExportConfig)


def read_config(path: Path) -> ReconstructConfig:
    """Settings from JSON `{"stage": {"setting": value}}`; absent settings keep their defaults; unknown ones are refused."""
    try:
        document = json.loads(path.read_text())
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}", hint="give a JSON file of settings") from error
    except ValueError as error:
        raise InputError(f"{path}: not JSON ({error})", hint='expected {"stage": {"setting": value}}') from error
    return config_from(document, str(path))


def config_from(document: Any, where: str) -> ReconstructConfig:
    """Settings from a parsed document; `where` names it in errors."""
    if not isinstance(document, dict):
        raise InputError(f"{where}: found {type(document).__name__}", hint='expected {"stage": {"setting": value}}')
    config = ReconstructConfig()
    for stage, settings in document.items():
        if stage not in {f.name for f in fields(config)}:
            raise InputError(
                f"{where}: unknown stage '{stage}'", hint=f"stages are {', '.join(f.name for f in fields(config))}"
            )
        known = {f.name: getattr(getattr(config, stage), f.name) for f in fields(getattr(config, stage))}
        for name, value in settings.items():
            if name not in known:
                raise InputError(f"{where}: unknown setting '{stage}.{name}'", hint=f"settings are {', '.join(known)}")
            if not _fits(value, known[name]):
                expected = type(known[name]).__name__
                raise InputError(f"{where}: {stage}.{name} is {value!r}", hint=f"expected {expected}, such as {known[name]!r}")
        changed = {k: tuple(v) if isinstance(v, list) else v for k, v in settings.items()}
        config = replace(config, **{stage: replace(getattr(config, stage), **changed)})
    return config


def _fits(value: Any, default: Any) -> bool:
    if default is None or value is None:
        return True
    if isinstance(default, bool) or isinstance(value, bool):
        return isinstance(value, bool) and isinstance(default, bool)
    if isinstance(default, float):
        return isinstance(value, int | float)
    if isinstance(default, tuple):
        return isinstance(value, list)
    return isinstance(value, type(default))
