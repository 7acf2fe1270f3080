"""One schema of each document, shared by the command line, the app, and external writers."""

import json
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel

from app import schemas
from r2c2r_core.codec import decode_noun, encode_noun
from r2c2r_core.commands.schema import NAMES, document_of, schema_text
from r2c2r_core.config import ReconstructConfig, config_from, read_config
from r2c2r_core.errors import InputError
from r2c2r_core.export.manifest import manifest_of
from r2c2r_core.export.plan import plan_bundle
from r2c2r_core.model.motion import Inside, JointMotion, State
from r2c2r_core.presets import PRESETS
from r2c2r_core.schema.manifest import Manifest, ManifestMotion
from r2c2r_core.schema.prompts import PromptsFile
from tests.core.export.kitchen import kitchen, reconstruction

PUBLISHED = Path(__file__).parents[3] / "docs" / "schemas"


@pytest.mark.parametrize("name", NAMES)
def test_published_schemas_match_the_models(name: str) -> None:
    again = f"r2c2r schema {name} > docs/schemas/{name}.json"
    assert (PUBLISHED / f"{name}.json").read_text(encoding="utf-8") == schema_text(name), again


def models_of(model: type[BaseModel]) -> Iterator[type[BaseModel]]:
    yield model
    for field in model.model_fields.values():
        for inner in _inside(field.annotation):
            yield from models_of(inner)


def _inside(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in getattr(annotation, "__args__", ()):
        yield from _inside(inner)


@pytest.mark.parametrize("name", NAMES)
def test_every_schema_model_and_field_is_documented(name: str) -> None:
    for model in models_of(document_of(name)):
        assert model.__doc__, model
        for key, field in model.model_fields.items():
            assert field.description, f"{model.__name__}.{key} says nothing of what it means"


def test_default_settings_pass_validation() -> None:
    written = json.loads(json.dumps(asdict(ReconstructConfig())))
    assert config_from(written, "config.json") == ReconstructConfig()


@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_changes_exactly_its_listed_settings(name: str) -> None:
    chosen, usual = asdict(read_config(None, name)), asdict(ReconstructConfig())
    changed = {stage: {key for key in chosen[stage] if chosen[stage][key] != usual[stage][key]} for stage in chosen}
    assert {stage: keys for stage, keys in changed.items() if keys} == {
        stage: set(keys) for stage, keys in PRESETS[name].items()
    }


def test_a_config_file_overrides_a_preset(tmp_path: Path) -> None:
    path = tmp_path / "config.json"
    path.write_text('{"generate": {"count": 3}}', encoding="utf-8")
    config = read_config(path, "paper")
    assert (config.generate.count, config.generate.rule, config.warp.method) == (3, "mean", "paper")


def test_given_settings_are_applied_and_others_keep_their_defaults() -> None:
    config = config_from({"warp": {"front_scale": [1, 2]}, "align": {"views": 3}, "ingest": {"near_m": 1}}, "config.json")
    assert (config.warp.front_scale, config.warp.depth_scale) == ((1.0, 2.0), (0.2, 5.0))
    assert (config.align.views, config.align.view_px, config.ingest.near_m) == (3, 128, 1.0)


@pytest.mark.parametrize(
    ("document", "says"),
    [
        ([], "the document is []"),
        ({"fly": {}}, "unknown key 'fly' in the document; expected ingest, segment"),
        ({"segment": 3}, "segment is 3; expected an object"),
        ({"segment": None}, "segment is null"),
        ({"ingest": {"colour": 1}}, "unknown key 'colour' in ingest; expected most_frames"),
        ({"generate": {"count": None}}, "generate.count is null; expected number of candidates per object, 1 to 10"),
        ({"generate": {"count": 0}}, "generate.count is 0; expected number of candidates per object, 1 to 10"),
        ({"generate": {"rule": "nonsense"}}, "generate.rule is 'nonsense'; expected medoid, or mean"),
        ({"warp": {"method": "axis"}}, "warp.method is 'axis'; expected axes, or paper"),
        ({"warp": {"front_scale": [1]}}, "warp.front_scale"),
        ({"ingest": {"finest_voxel_m": -1}}, "ingest.finest_voxel_m is -1; expected voxel size of the fusion"),
        ({"export": {"pictures": 1}}, "export.pictures is 1"),
        ({"align": {"views": True}}, "align.views is True"),
    ],
)
def test_an_invalid_setting_raises_a_one_line_error(document: Any, says: str) -> None:
    with pytest.raises(InputError) as caught:
        config_from(document, "config.json")
    assert says in str(caught.value)
    assert str(caught.value).startswith("config.json: ")
    assert "\n" not in str(caught.value)


def test_the_written_manifest_validates_against_its_schema() -> None:
    scene = kitchen()
    written = json.loads(json.dumps(manifest_of(reconstruction(scene), plan_bundle(scene), None)))
    assert [item.name for item in Manifest.model_validate(written).objects] == [item.name for item in scene.objects]


def test_the_app_uses_the_same_prompts_schema() -> None:
    assert schemas.PromptsFile is PromptsFile


def test_the_manifest_contains_the_fitted_motion_of_a_joint() -> None:
    scene = kitchen()
    motion = JointMotion(
        kind="revolute",
        axis_world=np.array([0.0, 0.0, 1.0]),
        pivot_world=np.zeros(3),
        covariance=1e-6 * np.eye(6),
        states={7: State(value=0.5, sigma=0.01), 3: State(value=None, sigma=None)},
        largest=0.5,
        source="measured",
        inside=Inside(depth_m=0.43, shelves_m=(0.2, 0.4)),
    )
    index = next(i for i, item in enumerate(scene.objects) if item.joints)
    item = scene.objects[index]
    filmed = replace(item, joints=(replace(item.joints[0], motion=motion), *item.joints[1:]))
    scene = replace(scene, objects=(*scene.objects[:index], filmed, *scene.objects[index + 1 :]))
    kept = decode_noun(encode_noun(scene, {}))[0]
    entry = manifest_of(reconstruction(kept), plan_bundle(kept), None)["objects"][index]["joint"]["motion"]
    assert entry["states"] == [{"frame": 3, "value": None, "sigma": None}, {"frame": 7, "value": 0.5, "sigma": 0.01}]
    assert (entry["inside"]["depth_m"], entry["inside"]["shelves_m"], entry["inside"]["board_m"]) == (0.43, [0.2, 0.4], None)
    assert ManifestMotion.model_validate(json.loads(json.dumps(entry))).largest == 0.5
