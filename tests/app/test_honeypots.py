"""Honeypots: sample kitchens in a person's queue, scored against ground truth for admins, and unrecognisable to others."""

import csv
import io
import json
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from sqlalchemy import event

from app.db.engine import reading
from app.db.tables import Project
from app.store.protocol import Folder
from r2c2r_core.workspace import Workspace
from tests.app.nouns import capture
from tests.app.test_opinions import click
from tests.app.test_project_members import Kept, kept

__all__ = ["kept"]


def write_truth(source: Path) -> None:
    """Ground truth with a cabinet and an oven visible in two frames, and a bottle that is hardly visible."""
    objects = []
    for name, category, x, size in (("front_1", "cabinet", 60, 20), ("oven_1", "oven", 120, 20), ("bottle_1", "bottle", 20, 4)):
        objects.append({"name": name, "category": category})
        folder = source / "truth_masks" / name
        folder.mkdir(parents=True)
        mask = np.zeros((120, 160), np.uint8)
        mask[50 : 50 + size, x - 10 : x - 10 + size] = 255
        for frame in (0, 3):
            cv2.imwrite(str(folder / f"{frame:06d}.png"), mask)
    (source / "truth.json").write_text(json.dumps({"objects": objects}))


@pytest.fixture
def slipped(kept: Kept) -> str:
    """Id of a honeypot in Alice's queue."""
    write_truth(kept.web.settings.data_dir / "projects" / kept.project / "source")
    body = {"person": "alice", "name": "Flat 7"}
    answer = kept.of["root"].post(f"/api/projects/{kept.project}/honeypot", json=body)
    assert answer.status_code == 201, answer.text
    return str(answer.json()["project"])


def test_a_honeypot_looks_like_any_assigned_project(kept: Kept, slipped: str) -> None:
    assert [row["name"] for row in kept.of["alice"].get("/api/inbox").json()["assigned"]] == ["Flat 7"]
    seen: dict[str, Any] = kept.of["alice"].get(f"/api/projects/{slipped}").json()
    assert (seen["source_name"], seen["status"], seen["counts"]["objects"], seen["job"]) == ("scan.r3d", "ready", 0, None)
    told = json.dumps([seen, kept.of["alice"].get(f"/api/projects/{slipped}/history").json()]).lower()
    assert "honeypot" not in told
    assert "sample" not in told
    (row,) = kept.of["root"].get("/api/honeypots").json()
    assert (row["project"], row["person"], row["review_state"]) == (slipped, "alice", "draft")
    assert kept.of["root"].get("/api/audit").json()["entries"][0]["action"] == "honeypot"


def test_the_recording_of_a_honeypot_and_so_its_bundle_are_not_named_after_the_sample(kept: Kept) -> None:
    projects = kept.web.settings.data_dir / "projects"
    write_truth(projects / kept.project / "source")
    work = Workspace(projects / kept.project / "work")
    work.save("ingest", "scene", replace(capture(), name="Sample kitchen"), {"key": "k", "seconds": 1.0})
    body = {"person": "alice", "name": "Flat 7"}
    made = kept.of["root"].post(f"/api/projects/{kept.project}/honeypot", json=body).json()["project"]
    assert [path.name for path in (projects / made / "source").glob("*.r3d")] == ["scan.r3d"]
    with reading(kept.web.context.engine) as session:
        assert session.get_one(Project, made).source_path == str(projects / made / "source" / "scan.r3d")
    titles = {one: Workspace(projects / one / "work").load_bare("ingest", "scene").name for one in (made, kept.project)}
    assert titles == {made: "scan", kept.project: "Sample kitchen"}
    told = [path.read_text().lower() for path in (projects / made).glob("*.json")]
    assert not any("sample kitchen" in text for text in told)


def test_only_admins_create_and_see_honeypots(kept: Kept, slipped: str) -> None:
    for name in ("alice", "bob"):
        assert kept.of[name].get("/api/honeypots").status_code == 403
        assert kept.of[name].get(f"/api/projects/{slipped}/honeypot").status_code == 403
        body = {"person": "alice", "name": "Flat 8"}
        assert kept.of[name].post(f"/api/projects/{kept.project}/honeypot", json=body).status_code == 403
    assert kept.of["root"].get(f"/api/projects/{kept.project}/honeypot").status_code == 404
    copy = kept.of["alice"].post(f"/api/projects/{slipped}/duplicate").json()["id"]
    assert kept.of["root"].get(f"/api/projects/{copy}/honeypot").status_code == 404  # a copy is not a honeypot


def test_a_honeypot_of_a_members_only_sample_is_visible_to_its_person(kept: Kept, slipped: str) -> None:
    own = kept.of["root"].post(f"/api/projects/{kept.project}/duplicate").json()["id"]
    kept.of["root"].put(f"/api/projects/{own}/members", json={"members_only": True})
    made = kept.of["root"].post(f"/api/projects/{own}/honeypot", json={"person": "Bob", "name": "Flat 9"}).json()
    assert made["person"] == "bob"
    assert kept.of["bob"].get(f"/api/projects/{own}").status_code == 404
    assert kept.of["bob"].get(f"/api/projects/{made['project']}").json()["assignee"] == "bob"
    unknown = kept.of["root"].post(f"/api/projects/{own}/honeypot", json={"person": "dave", "name": "Flat 9"})
    assert unknown.status_code == 404


def test_a_honeypot_without_ground_truth_is_refused(kept: Kept) -> None:
    body = {"person": "alice", "name": "Flat 7"}
    refused = kept.of["root"].post(f"/api/projects/{kept.project}/honeypot", json=body)
    assert (refused.status_code, refused.json()["message"]) == (409, "the truth of Sample kitchen is not known")
    assert len(kept.of["root"].get("/api/projects").json()) == 1


def test_no_database_connection_is_open_while_the_recording_is_fetched(kept: Kept, monkeypatch: pytest.MonkeyPatch) -> None:
    engine, taken, fetches = kept.web.context.engine, dict[int, int](), list[bool]()
    event.listen(engine, "checkout", lambda connection, *_: taken.update({id(connection): threading.get_ident()}))
    event.listen(engine, "checkin", lambda connection, *_: taken.pop(id(connection), None))
    monkeypatch.setattr(Folder, "fetch", lambda *_, **__: fetches.append(threading.get_ident() in taken.values()))
    write_truth(kept.web.settings.data_dir / "projects" / kept.project / "source")
    body = {"person": "alice", "name": "Flat 9"}
    made = kept.of["root"].post(f"/api/projects/{kept.project}/honeypot", json=body).json()["project"]
    assert kept.of["root"].get(f"/api/projects/{made}/honeypot").status_code == 200
    assert set(fetches) == {False}


def test_honeypot_objects_are_scored_by_mask_iou_and_category(kept: Kept, slipped: str) -> None:
    at = f"/api/projects/{slipped}"
    blank: dict[str, Any] = kept.of["root"].get(f"{at}/honeypot").json()
    assert [blank[key] for key in ("found", "extra", "mean_iou", "same_category")] == [0, 0, None, 0]
    assert [one["name"] for one in blank["objects"]] == ["front_1", "oven_1"]  # the bottle is too small to be required

    paint(kept, slipped, "door_1", "door", 60, 16)
    click(kept, slipped, "fridge", "refrigerator", 30)  # not on any such object
    found: dict[str, Any] = kept.of["root"].get(f"{at}/honeypot").json()
    assert [found[key] for key in ("found", "extra", "same_category")] == [1, 1, 1]
    assert found["mean_iou"] == pytest.approx(16 / 20)

    def effort(name: str) -> list[dict[str, str]]:
        return list(csv.DictReader(io.StringIO(kept.of[name].get(f"{at}/effort.csv").text)))

    lines = {line["object"]: line for line in effort("root") if line["object"]}
    assert (lines["door_1"]["true object"], lines["door_1"]["mask IoU"], lines["door_1"]["same category"]) == (
        "front_1",
        "0.800",
        "yes",
    )
    assert lines["fridge"]["true object"] == ""
    assert [line["true object"] for line in effort("root") if line["true object"] and not line["object"]] == ["oven_1"]
    assert "true object" not in effort("alice")[0]


def paint(kept: Kept, project: str, name: str, category: str, x: int, width: int) -> None:
    """An object whose masks in the truth's frames are the true ones, narrower."""
    click(kept, project, name, category, x)
    item = next(row for row in kept.of["root"].get(f"/api/projects/{project}/objects").json() if row["name"] == name)
    folder = kept.web.settings.data_dir / "projects" / project / "masks" / str(item["id"])
    (path,) = folder.glob("*.jsonl")
    mask = np.zeros((120, 160), bool)
    mask[50:70, x - 10 : x - 10 + width] = True
    from app.jobs import mask_store
    from app.jobs.mask_wire import mask_bits
    from r2c2r_core.geometry.masks import pack_mask

    bits = mask_bits(pack_mask(mask), 160)
    entries = [{"frame": frame, "confidence": 0.9, "area": 0.1, "mask": bits} for frame in (0, 3)]
    mask_store.write(path, entries, "geometric")
