from r2c2r_core.export.writers.table import FORMATS
from tests.app.conftest import Running
from tests.app.test_jobs import run


def test_versioned_frames_are_immutable_and_others_are_revalidated(web: Running) -> None:
    project = web.sample()
    version = web.get(f"/api/projects/{project}")["media_version"]
    answer = web.client.get(f"/media/{project}/frames/3.jpg?w=100&v={version}")
    assert answer.headers["content-type"] == "image/jpeg"
    assert "immutable" in answer.headers["cache-control"]
    assert "max-age=31536000" in answer.headers["cache-control"]
    assert "private" in answer.headers["cache-control"]
    again = web.client.get(f"/media/{project}/frames/3.jpg?w=100", headers={"if-none-match": answer.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    assert "immutable" not in again.headers["cache-control"]


def test_frames_are_sent_unchanged_and_never_enlarged(web: Running) -> None:
    project = web.sample()
    stored = web.settings.data_dir / "projects" / project / "work" / "capture" / "rgb" / "000003.jpg"
    assert web.client.get(f"/media/{project}/frames/3.jpg").content == stored.read_bytes()
    assert web.client.get(f"/media/{project}/frames/3.jpg?w=960").content == stored.read_bytes()  # images are never enlarged
    previews = web.settings.data_dir / "projects" / project / "previews"
    assert not previews.exists()
    assert web.client.get(f"/media/{project}/thumbnail.jpg").status_code == 200


def test_missing_media_return_errors_with_a_kind(web: Running) -> None:
    project = web.sample()
    for path in ("frames/1.jpg", "frames/99.jpg", "depth/1.png", "preview.png", "scene.glb", "bundles/1.zip"):
        answer = web.client.get(f"/media/{project}/{path}")
        assert answer.status_code in (404, 409), path
        assert answer.json()["kind"] in ("not-found", "not-ready")


def test_depth_is_sent_as_a_png_image(web: Running) -> None:
    answer = web.client.get(f"/media/{web.sample()}/depth/3.png")
    assert answer.content.startswith(b"\x89PNG")


def test_the_scan_plan_rendered_at_import_is_sent(web: Running) -> None:
    project = web.sample()
    assert web.client.get(f"/media/{project}/scan/plan.png").json()["kind"] == "not-found"  # an older version's project
    drawn = web.settings.data_dir / "projects" / project / "scan-plan.png"
    drawn.write_bytes(b"\x89PNG drawn")
    answer = web.client.get(f"/media/{project}/scan/plan.png?v=1")
    assert (answer.content, answer.headers["content-type"]) == (b"\x89PNG drawn", "image/png")
    assert web.client.get(f"/media/{project}/scan/elsewhere.png").status_code == 422


def test_a_bundle_download_is_resumable_and_has_its_checksum_as_etag(web: Running) -> None:
    project = web.sample()
    web.job(run(web, project), "done")
    (bundle,) = web.get(f"/api/projects/{project}/bundles")
    whole = web.client.get(bundle["url"])
    assert whole.headers["accept-ranges"] == "bytes"
    assert whole.headers["etag"] == f'"{bundle["sha256"]}"'
    assert bundle["file_name"] in whole.headers["content-disposition"]
    assert len(whole.content) == bundle["size"]
    tail = web.client.get(bundle["url"], headers={"range": "bytes=100-", "if-range": whole.headers["etag"]})
    assert (tail.status_code, tail.content) == (206, whole.content[100:])


def test_the_report_is_sandboxed_without_scripts(web: Running) -> None:
    project = web.sample()
    web.job(run(web, project), "done")
    policy = web.client.get(f"/media/{project}/report.html").headers["content-security-policy"]
    assert policy.startswith("sandbox allow-same-origin; default-src 'none'")  # for the cookie that loads its pictures
    assert "script" not in policy


def test_the_scene_page_is_sandboxed_without_same_origin_or_network_access(web: Running) -> None:
    project = web.sample()
    web.job(run(web, project), "done")
    policy = web.client.get(f"/media/{project}/review.html").headers["content-security-policy"]
    assert policy.startswith("sandbox allow-scripts; default-src 'none'")
    assert "allow-same-origin" not in policy
    assert "connect-src" not in policy


def test_a_download_of_selected_formats_has_its_own_etag_and_is_resumable(web: Running) -> None:
    project = web.sample()
    web.job(run(web, project), "done")
    address = f"/media/{project}/bundles/1.zip?formats=urdf"
    part = web.client.get(address)
    assert part.headers["etag"] != web.client.get(f"/media/{project}/bundles/1.zip").headers["etag"]
    tail = web.client.get(address, headers={"range": "bytes=20-", "if-range": part.headers["etag"]})
    assert (tail.status_code, tail.content) == (206, part.content[20:])
    assert "glb, mjcf, ros, sdf, urdf, usd" in web.get(f"/media/{project}/bundles/1.zip?formats=exe", 422)["hint"]
    offered = [(entry["name"], entry["file"]) for entry in web.get("/api/system")["formats"]]
    assert offered == [(entry.name, entry.file) for entry in FORMATS]  # only the core's table defines formats
    assert web.get(f"/api/projects/{project}/bundles/1/changes?since=1") == []
    web.get(f"/api/projects/{project}/bundles/1/changes?since=7", 404)
