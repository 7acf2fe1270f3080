"""Failure of a backend on one object in the pipeline."""

import json
import zipfile
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.align.stage import AlignConfig, Placer
from r2c2r_core.config import ReconstructConfig
from r2c2r_core.errors import BackendUnavailable, InputError
from r2c2r_core.generate.candidates import select_candidate, weighed
from r2c2r_core.generate.consensus import choose_candidate
from r2c2r_core.generate.stage import GenerateConfig, generate_candidates
from r2c2r_core.geometry.meshes import box_mesh
from r2c2r_core.ledger import Kept, Ledger, Reached
from r2c2r_core.model.inputs import ObjectOverride, Overrides, Prompts
from r2c2r_core.model.mesh import TexturedMesh
from r2c2r_core.pipeline import DISPUTED, Request, Tools, generate_objects, place_objects, reconstruct, restricted_licences
from r2c2r_core.pool import Pool
from r2c2r_core.progress import SILENT
from r2c2r_core.workspace import Workspace
from tests.core.generate import scenes
from tests.core.generate.stub import answering, box_glb, said
from tests.core.generate.test_remote import nim_answer


@pytest.fixture(scope="module")
def two_bottles():
    """One capture, and two tracks of the same bottle."""
    capture, track = scenes.bottle_scene()
    return capture, {name: Kept(replace(track, name=name), name) for name in ("good_1", "bad_1")}


def request_for(address: str, overrides: Overrides | None = None) -> Request:
    quick = AlignConfig(views=3, match_photos=1, match_views=4, settled=4, refined=1, points=300, surface_points=1000)
    config = ReconstructConfig(generate=GenerateConfig(count=1, pool_frames=6, url=f"{address}/v1/infer"), align=quick)
    return Request(
        source=Path("scan"),
        prompts=Prompts(objects=()),
        overrides=overrides or Overrides(objects={}),
        config=config,
        tools=Tools(generator="remote"),
    )


def refusing_the_second(*_request):
    refusing_the_second.count += 1
    return nim_answer(box_glb()) if refusing_the_second.count == 1 else said(500, {"detail": "CUDA out of memory"})


def test_a_failing_generator_falls_back_to_completion_with_a_warning(two_bottles, tmp_path):
    capture, tracks = two_bottles
    refusing_the_second.count = 0
    with answering(refusing_the_second) as (address, asked):
        ledger = Ledger(Workspace(tmp_path), SILENT)
        found = generate_objects(request_for(address), ledger, Kept(capture, "c"), tracks)
        assert list(found) == ["good_1", "bad_1"]
        assert not ledger.failures
        assert found["good_1"].value.chosen.generator == "remote:trellis-nim"
        assert found["good_1"].value.chosen.warnings == ()
        for asset in found["bad_1"].value.candidates:
            assert asset.generator == "completion"
            assert "remote made no mesh, completion was used instead" in asset.warnings[0]
            assert "CUDA out of memory" in asset.warnings[0]

        # the failure is not stored: the next run requests that object again, and no other
        asked.clear()
        refusing_the_second.count = 0
        again = generate_objects(request_for(address), Ledger(Workspace(tmp_path), SILENT), Kept(capture, "c"), tracks)
    assert len(asked) == 1
    assert again["bad_1"].value.chosen.generator == "remote:trellis-nim"
    assert again["bad_1"].key != found["bad_1"].key
    assert again["good_1"].key == found["good_1"].key


def test_an_upload_is_the_only_candidate_if_the_generator_fails(two_bottles, tmp_path):
    capture, tracks = two_bottles
    (tmp_path / "box.glb").write_bytes(box_glb())
    overrides = Overrides(objects={"bad_1": ObjectOverride(candidate=str(tmp_path / "box.glb"))})
    with answering(lambda *request: said(500, {"detail": "broken"})) as (address, _):
        ledger = Ledger(Workspace(tmp_path / "work"), SILENT)
        found = generate_objects(request_for(address, overrides), ledger, Kept(capture, "c"), {"bad_1": tracks["bad_1"]})
    (asset,) = found["bad_1"].value.candidates
    assert asset.generator == "upload"
    assert "remote made no mesh" in asset.warnings[0]


def test_an_upload_is_added_without_regenerating_candidates(two_bottles, tmp_path):
    capture, tracks = two_bottles
    (tmp_path / "mine.glb").write_bytes(box_glb((0.4, 0.3, 0.1)))
    overrides = Overrides(objects={"bad_1": ObjectOverride(candidate=str(tmp_path / "mine.glb"))})
    one = {"bad_1": tracks["bad_1"]}
    with answering(lambda *request: nim_answer(box_glb())) as (address, asked):
        before, after = (
            generate_objects(request_for(address, said), Ledger(Workspace(tmp_path / "work"), SILENT), Kept(capture, "c"), one)
            for said in (None, overrides)
        )
    assert len(asked) == 1
    assert [c.candidate_id for c in after["bad_1"].value.candidates] == ["c0", "upload0"]
    assert after["bad_1"].value.candidates[0].generator == "remote:trellis-nim"
    assert before["bad_1"].key != after["bad_1"].key


def test_a_changed_upload_under_the_same_name_changes_the_key(two_bottles, tmp_path):
    capture, tracks = two_bottles
    path = tmp_path / "mine.glb"
    overrides = Overrides(objects={"bad_1": ObjectOverride(candidate=str(path))})
    keys = []
    with answering(lambda *request: nim_answer(box_glb())) as (address, _):
        for sides in ((0.4, 0.3, 0.2), (0.4, 0.3, 0.2), (0.4, 0.3, 0.1)):
            path.write_bytes(box_glb(sides))
            ledger = Ledger(Workspace(tmp_path / "work"), SILENT)
            found = generate_objects(request_for(address, overrides), ledger, Kept(capture, "c"), {"bad_1": tracks["bad_1"]})
            keys.append(found["bad_1"].key)
    assert keys[0] == keys[1] != keys[2]


def test_further_candidates_are_added_without_repeating_existing_ones(two_bottles, tmp_path):
    capture, tracks = two_bottles
    one = {"bad_1": tracks["bad_1"]}
    asked_again = Overrides(objects={"bad_1": ObjectOverride(rejected=("c0",), regenerate=1)})

    def run(overrides, work):
        request = replace(request_for("http://nowhere", overrides), tools=Tools())
        return generate_objects(request, Ledger(Workspace(tmp_path / work), SILENT), Kept(capture, "c"), one)["bad_1"]

    first = run(Overrides(objects={}), "kept")
    further, anew = run(asked_again, "kept"), run(asked_again, "empty")
    assert [c.candidate_id for c in further.value.candidates] == ["c0", "c1"]
    assert further.key != first.key
    old, new = further.value.candidates
    assert np.array_equal(old.mesh.vertices, first.value.chosen.mesh.vertices)
    assert new.parameters != old.parameters  # another variation
    assert anew.key == further.key
    for one_way, other_way in zip(further.value.candidates, anew.value.candidates, strict=True):
        assert np.array_equal(one_way.mesh.vertices, other_way.mesh.vertices)
    chosen = select_candidate(further.value, asked_again.of("bad_1"), "medoid")
    assert chosen.chosen_id == "c1"


def test_external_meshes_are_placed_and_scored_by_the_frames(two_bottles):
    """A bottle and a flat box with equal shape metrics: only masks and depth can select the correct mesh."""
    capture, tracks = two_bottles
    track = tracks["good_1"].value
    bottle = generate_candidates(capture, track, "completion", GenerateConfig(count=1, pool_frames=6)).chosen
    shape_only = {k: v for k, v in bottle.metrics.items() if k not in ("mask_iou", "depth_residual_m")}
    vertices, faces = box_mesh(np.array([-0.5, -0.4, -0.02]), np.array([0.5, 0.4, 0.02]))
    flat = TexturedMesh(vertices=vertices, faces=faces, uv=np.zeros((len(vertices), 2)), texture=bottle.mesh.texture)
    pair = (
        replace(bottle, candidate_id="c0", generator="remote", mesh=flat, metrics=shape_only),
        replace(bottle, candidate_id="c1", generator="remote", metrics=shape_only),
    )
    before = choose_candidate(pair)
    assert before.chosen_id == "c0"  # a tie
    config = AlignConfig(views=4, match_photos=1, match_views=8, settled=8, refined=2, points=400, surface_points=1500)
    after = weighed(capture, track, before, Placer("sift", config), "medoid")
    assert after.chosen_id == "c1"
    assert after.chosen.metrics["mask_iou"] > 0.7
    assert "outline agrees" in after.reason


def test_an_unconfigured_generator_stops_the_run_with_a_clear_error(two_bottles, tmp_path, monkeypatch):
    monkeypatch.delenv("R2C2R_GENERATOR_URL", raising=False)
    capture, tracks = two_bottles
    request = replace(request_for("http://h"), config=ReconstructConfig())
    with pytest.raises(BackendUnavailable, match="generator 'remote' has no address"):
        generate_objects(request, Ledger(Workspace(tmp_path), SILENT), Kept(capture, "c"), tracks)


def test_restricted_licences_are_reported_and_never_the_default():
    plain = Request(source=Path("scan"), prompts=Prompts(objects=()))
    assert restricted_licences(plain) == []
    (line,) = restricted_licences(replace(plain, tools=Tools(matcher="superglue")))
    assert "matcher superglue" in line
    assert "non-commercial" in line
    papers = replace(plain.config, synthesize=replace(plain.config.synthesize, fixtures="scene-synthesizer"))
    (line,) = restricted_licences(replace(plain, config=papers))
    assert "fixtures scene-synthesizer" in line
    assert "triangle" in line


def contents(path):
    """A noun file's contents except for its seconds."""
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    structure = json.loads(members.pop("noun.json"))
    del structure["header"]["seconds"]
    return structure, members


def run_by(workers, folder, two_bottles):
    """A run of both bottles into a folder by that many processes."""
    capture, tracks = two_bottles
    recording = Kept(capture, "c")
    request = replace(request_for("http://nowhere"), tools=Tools())
    with Pool(workers) as pool:
        run = Ledger(Workspace(folder), SILENT, pool=pool)
        found = generate_objects(request, run, recording, tracks)
        choices = {name: kept.value for name, kept in found.items()}
        placed = place_objects(request, run, recording, tracks, found, choices)
        assert list(found) == list(placed) == list(tracks)
        assert sorted(run.work.computed) == sorted(f"{stage}/{name}" for stage in ("generate", "align") for name in tracks)
        assert (workers > 1) == bool(pool._idle)


@pytest.fixture(scope="module")
def one_run(two_bottles, tmp_path_factory):
    """The folder of a run of both bottles by one process."""
    folder = tmp_path_factory.mktemp("one_run")
    run_by(1, folder, two_bottles)
    return folder


def assert_stored_alike(folder, other):
    stored = {path.relative_to(folder) for path in folder.rglob("*.noun")}
    assert len(stored) == 4
    for path in stored:
        assert contents(folder / path) == contents(other / path)


def test_two_workers_store_the_same_keys_and_bytes_as_one(two_bottles, one_run, tmp_path):
    run_by(2, tmp_path, two_bottles)
    assert_stored_alike(one_run, tmp_path)


def test_several_partial_runs_store_the_same_results_as_one_run(two_bottles, one_run, tmp_path):
    capture, tracks = two_bottles
    recording = Kept(capture, "c")
    request = replace(request_for("http://nowhere"), tools=Tools())

    def run_of(until, only=None):
        run = Ledger(Workspace(tmp_path), SILENT, until, only=only)
        with suppress(Reached):
            found = generate_objects(request, run, recording, tracks)
            choices = {name: kept.value for name, kept in found.items()}
            place_objects(request, run, recording, tracks, found, choices)
        return run

    for stage in ("generate", "align"):
        assert run_of(stage, []).left == list(tracks)
        for name in tracks:
            assert run_of(stage, [name]).work.computed == [f"{stage}/{name}"]
        assert run_of(stage).work.computed == []
    assert_stored_alike(one_run, tmp_path)


@pytest.mark.parametrize(
    ("until", "only", "said"), [("warp", [], "not computed per object"), ("align", ["door_9"], "door_9: no such object")]
)
def test_an_invalid_partial_run_raises_a_clear_error(until, only, said, tmp_path):
    with pytest.raises(InputError, match=said):
        reconstruct(request_for("http://nowhere"), Workspace(tmp_path), until=until, only=only)


def test_results_shared_by_all_objects_are_not_listed_as_an_object(tmp_path: Path) -> None:
    work = Workspace(tmp_path)
    for name in ("door_1", DISPUTED):
        work.save("segment", name, {}, {"key": "k", "seconds": 0.0})
    assert work.load_latest("segment", DISPUTED) == {}
    assert work.names("segment") == ["door_1"]
