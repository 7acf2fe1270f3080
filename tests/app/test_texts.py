"""Bounds and printability of texts, at every input."""

import json
from collections.abc import Iterator
from typing import Any

import pytest

from tests.app.conftest import Running

UNSHOWN = {
    "NUL": "\x00",
    "ESC": "\x1b[31m",
    "C1": "\x9b31m",
    "override": "\u202egnp",
    "isolate": "\u2066a",
    "surrogate": "\ud800",
}


def send(web: Running, method: str, path: str, body: Any) -> Any:
    """Send a body as pure-ASCII JSON, so that a lone surrogate can be sent."""
    return web.client.request(method, path, content=json.dumps(body), headers={"content-type": "application/json"})


@pytest.mark.parametrize("text", UNSHOWN.values(), ids=UNSHOWN)
def test_unprintable_text_is_refused_in_one_line(web: Running, text: str) -> None:
    project = web.sample()
    at = f"/api/projects/{project}"
    for method, path, body in (
        ("PATCH", at, {"name": f"a{text}b"}),
        ("POST", "/api/projects/sample", {"name": text}),
        ("POST", f"{at}/objects", {"category": f"mug{text}"}),
        ("PATCH", f"{at}/objects/1", {"category": text}),
        ("POST", f"{at}/comments", {"text": f"look {text}"}),
        ("POST", f"{at}/review", {"from_state": "draft", "to": "ready", "reason": text}),
        ("PATCH", f"{at}/objects/1/override", {"candidate": text}),
        ("POST", f"{at}/objects/1/verdicts", {"candidate": text, "verdict": "accepted"}),
        ("POST", f"{at}/viewer/joints", {"values": {text: 0.1}}),
        ("POST", f"{at}/proposals/dismiss", {"ids": [text]}),
        ("POST", f"{at}/prompts.json", {"version": 1, "objects": [{"name": "a", "category": text, "points": []}]}),
        ("POST", "/api/uploads", {"file_name": text, "size": 5}),
        ("POST", "/api/accounts", {"name": text, "role": "admin", "password": "three words long"}),
    ):
        answer = send(web, method, path, body)
        assert answer.status_code == 422, f"{method} {path}: {answer.status_code} {answer.text}"
        assert "\n" not in answer.json()["message"]


def test_paths_that_are_invalid_file_names_are_not_found(web: Running) -> None:
    project = web.sample()
    for part in ("%00", "a%1bb", "%E2%80%AE", "c" * 300):
        assert web.client.get(f"/media/{project}/candidates/1/{part}.png").status_code == 404
        assert web.client.get(f"/static/js/{part}").status_code == 404
        assert web.client.patch(f"/api/accounts/{part}", json={}).status_code == 404
    assert web.client.get(f"/media/{project}/thumbnail.jpg?v=%00").status_code == 422
    assert web.client.post("/api/projects/upload?filename=a%00.r3d", content=b"x").status_code == 422
    assert web.client.get("/api/browse", params={"path": "a" * 5000}).status_code == 422


def test_a_candidate_name_longer_than_a_file_name_is_refused(web: Running) -> None:
    at = f"/api/projects/{web.sample()}/objects/1/override"
    for name in ("a" * 256, "ä" * 200):
        answer = send(web, "PATCH", at, {"candidate": name})
        assert answer.status_code == 422
        assert all(word in answer.json()["message"] for word in ("candidate", "255"))


def test_blank_names_are_refused_and_whitespace_is_normalised(web: Running) -> None:
    at = f"/api/projects/{web.sample()}"
    for body in ({"name": "  "}, {"name": "\n\t"}):
        assert send(web, "PATCH", at, body).status_code == 422
    assert web.patch(at, {"name": "  A\n kitchen "})["name"] == "A kitchen"
    assert send(web, "POST", f"{at}/comments", {"text": " \n"}).status_code == 422
    assert web.post(f"{at}/comments", {"text": "one\ntwo "}, 201)["text"] == "one\ntwo"


def test_every_text_field_of_a_request_body_has_a_maximum_length(web: Running) -> None:
    document = web.app.openapi()
    unbound = {
        f"{operation['operationId']}: {where}"
        for path in document["paths"].values()
        for operation in path.values()
        if isinstance(operation, dict) and "requestBody" in operation
        for content in operation["requestBody"]["content"].values()
        for where, schema in texts(document, content["schema"], "")
        if "maxLength" not in schema and not {"enum", "const"} & schema.keys()
    }
    assert unbound == set()


def texts(document: dict[str, Any], schema: dict[str, Any], where: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """Every string that a body may contain, including keys, with its location."""
    if "$ref" in schema:
        yield from texts(document, document["components"]["schemas"][schema["$ref"].rsplit("/", 1)[-1]], where)
    for part in (*schema.get("anyOf", ()), *schema.get("allOf", ())):
        yield from texts(document, part, where)
    if schema.get("type") == "string":
        yield where, schema
    if "items" in schema:
        yield from texts(document, schema["items"], f"{where}[]")
    if isinstance(schema.get("additionalProperties"), dict):
        yield f"{where} (keys)", schema.get("propertyNames", {})
        yield from texts(document, schema["additionalProperties"], f"{where}{{}}")
    for name, inner in schema.get("properties", {}).items():
        yield from texts(document, inner, f"{where}.{name}")
