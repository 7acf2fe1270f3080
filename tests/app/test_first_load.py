"""Compressed size of our own code that a browser loads before it shows the first page."""

import posixpath
import re
from html import unescape
from pathlib import Path

import pytest

from app.services import pages
from tests.app.conftest import Running

MOST_BYTES = 200_000
ASSET = re.compile(r'(?:href|src)="(/static/[^"]+)"')
IMPORT = re.compile(r'(?:^|\n)\s*(?:import|export)\b[^;]*?from\s+"(\.[^"]+)"|(?:^|\n)import\s+"(\.[^"]+)"')


def test_the_first_page_is_small_and_loads_nothing_from_other_sites(web: Running) -> None:
    page = web.client.get("/").text
    waiting, sizes = ASSET.findall(page), {"/": len(page.encode())}
    while waiting:
        path = waiting.pop()
        if path in sizes:
            continue
        with web.client.stream("GET", path) as answer:
            assert answer.status_code == 200, path
            sizes[path] = len(b"".join(answer.iter_raw()))
        if path.endswith(".js"):
            found = (one or two for one, two in IMPORT.findall(web.client.get(path).text))
            waiting += [posixpath.normpath(posixpath.join(posixpath.dirname(path), name)) for name in found]
    assert any(path.endswith("pages/projects.js") for path in sizes), "the imports are followed"
    assert sum(sizes.values()) < MOST_BYTES, sorted(sizes.items(), key=lambda item: -item[1])[:8]
    foreign = re.findall(r'(?:href|src)="(https?:)?//', page)
    assert foreign == []


def asked_at_once(page: str, rel: str) -> list[str]:
    return [unescape(found) for found in re.findall(rf'<link rel="{rel}"[^>]*href="([^"]+)"', page)]


def test_pages_preload_every_module_they_import(web: Running) -> None:
    for path in ("/", "/people", "/p/any", "/p/any/annotate", "/p/any/review"):
        asked = asked_at_once(web.client.get(path).text, "modulepreload")
        assert len(asked) == len(set(asked)) > 10
        for module in asked:
            text = web.client.get(module).text
            needed = [one or two for one, two in IMPORT.findall(text)]
            assert {posixpath.normpath(posixpath.join(posixpath.dirname(module), name)) for name in needed} <= set(asked), (
                module
            )


def test_the_annotation_page_preloads_the_frame_it_shows(web: Running) -> None:
    project = web.sample()
    frames = f"/api/projects/{project}/frames"
    indices = [frame["index"] for frame in web.get(frames)]
    for query, shown in (
        ("", indices[0]),
        (f"?frame={indices[2]}", indices[2]),
        ("?frame=99999", indices[0]),
        ("?frame=²", indices[0]),
    ):
        picture, table = asked_at_once(web.client.get(f"/p/{project}/annotate{query}").text, "preload")
        assert table == frames
        assert picture.startswith(f"/media/{project}/frames/{shown}.jpg?w=960&v="), query
        assert web.client.get(picture).headers["content-type"] == "image/jpeg"
    for path in (f"/p/{project}/run", "/p/none/annotate", '/p/"><script>/annotate'):
        page = web.client.get(path)
        assert page.status_code == 200, path
        assert asked_at_once(page.text, "preload") == [], path
        assert page.text.count("<script") == 1, path


def test_static_files_are_compressed_and_revalidated_by_etag(web: Running) -> None:
    first = web.client.get("/static/js/main.js")
    assert first.headers["content-encoding"] == "gzip"
    assert first.headers["content-type"].startswith("text/javascript")
    plain = web.client.get("/static/js/main.js", headers={"accept-encoding": "identity"})
    assert plain.content == first.content
    assert "content-encoding" not in plain.headers
    again = web.client.get("/static/js/main.js", headers={"if-none-match": first.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    assert web.client.head("/static/js/main.js").status_code == 200
    assert web.client.get("/static/js").status_code == 404
    assert web.client.get("/static/js/none.js").status_code == 404


def test_a_page_names_static_files_of_the_current_version_which_browsers_keep(web: Running) -> None:
    page = web.client.get("/").text
    asked = set(ASSET.findall(page))
    assert len(asked) > 50
    for path in asked:
        assert "immutable" in web.client.get(path).headers["cache-control"], path
    kept = re.sub(r"@\w+", "@0123456789ab", min(asked))  # of another version, after an update
    for revalidated in (kept, re.sub(r"@\w+/", "", min(asked))):
        assert web.client.get(revalidated).headers["cache-control"] == "no-cache"


def test_a_change_of_a_static_file_changes_the_version(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    main = tmp_path / "js" / "main.js"
    main.parent.mkdir()
    versions = []
    for second, text in enumerate(("one", "two words")):
        main.write_text(text)
        monkeypatch.setattr(pages, "monotonic", lambda now=float(second): now)
        versions += [pages.version_of(tmp_path), pages.version_of(tmp_path)]
    assert versions[0] == versions[1] != versions[2] == versions[3]
