"""ReconstructConfig: one frozen dataclass per stage, each declared in its stage; presets, and --config from JSON."""

from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from r2c2r_core.align.stage import AlignConfig
from r2c2r_core.documents import read_json
from r2c2r_core.export.stage import ExportConfig
from r2c2r_core.generate.stage import GenerateConfig
from r2c2r_core.ingest.stage import IngestConfig
from r2c2r_core.presets import PRESETS
from r2c2r_core.schema.settings import tuned_numbers, with_settings
from r2c2r_core.segment.stage import SegmentConfig
from r2c2r_core.synthesize.stage import SynthesizeConfig
from r2c2r_core.tuning import Changes
from r2c2r_core.warp.stage import WarpConfig


@dataclass(frozen=True, slots=True, kw_only=True)
class KitchenConfig:
    """Knowledge of kitchens shared by all stages (r2c2r_core/kitchen)."""

    params: Changes = tuned_numbers("kitchen")


@dataclass(frozen=True, slots=True, kw_only=True)
class GeometryConfig:
    """The geometry that all stages share (r2c2r_core/geometry)."""

    params: Changes = tuned_numbers("geometry")


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
    kitchen: KitchenConfig = field(default_factory=KitchenConfig)
    geometry: GeometryConfig = field(default_factory=GeometryConfig)

    @property
    def numbers(self) -> Changes:
        """The changed tuned numbers, by module path."""
        sections = {stage.name: getattr(self, stage.name) for stage in fields(self)}
        own = {room: getattr(section, "params", {}) for room, section in sections.items()}
        return {f"{room}.{module}": values for room, params in own.items() for module, values in params.items()}


def read_config(path: Path | None, preset: str = "default") -> ReconstructConfig:
    """Settings of a preset, changed by a JSON file `{"stage": {"setting": value}}`; raises InputError."""
    chosen = config_from(PRESETS[preset], f"preset {preset}")
    if path is None:
        return chosen
    return with_settings(chosen, read_json(path, hint='expected {"stage": {"setting": value}}'), str(path))


def config_from(document: Any, where: str) -> ReconstructConfig:
    """Settings from a parsed document; `where` names it in errors."""
    return with_settings(ReconstructConfig(), document, where)
