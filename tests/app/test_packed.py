import gzip

from tests.app.conftest import Running

PLAIN = {"accept-encoding": "identity"}


def test_text_is_gzipped_if_accepted_and_images_are_not(web: Running) -> None:
    project = web.sample()
    plain = web.client.get("/api/openapi.json", headers=PLAIN)
    assert "content-encoding" not in plain.headers
    assert int(plain.headers["content-length"]) == len(plain.content)
    with web.client.stream("GET", "/api/openapi.json") as packed:
        raw = b"".join(packed.iter_raw())
    assert (packed.headers["content-encoding"], packed.headers["vary"]) == ("gzip", "Accept-Encoding")
    assert "content-length" not in packed.headers
    assert len(raw) < len(plain.content) / 2
    assert gzip.decompress(raw) == plain.content
    for path in (f"/media/{project}/frames/3.jpg", "/api/health"):
        assert "content-encoding" not in web.client.get(path).headers  # already compressed, or small


def test_compression_keeps_headers_errors_and_replayed_responses(web: Running) -> None:
    project = web.sample()
    page = web.client.get("/")
    assert page.headers["content-encoding"] == "gzip"
    assert "content-security-policy" in page.headers
    refused = web.client.get(f"/api/projects/{project}/objects/77/candidates")
    assert (refused.status_code, refused.json()["kind"]) == (404, "not-found")
    log = web.client.get("/api/jobs/1/log", headers={"range": "bytes=0-3"})
    assert log.status_code == 200
    made = {"Idempotency-Key": "k"}
    first = web.client.post(f"/api/projects/{project}/objects", json={"category": "drawer"}, headers=made)
    again = web.client.post(f"/api/projects/{project}/objects", json={"category": "drawer"}, headers=made)
    assert (again.json(), again.headers["idempotency-replayed"]) == (first.json(), "true")  # the stored response is replayed
