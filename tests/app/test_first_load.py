"""What a browser fetches of our own code, as it crosses the wire, before it shows the first page."""

import posixpath
import re

from tests.app.conftest import Running

MOST_BYTES = 200_000
ASSET = re.compile(r'(?:href|src)="(/static/[^"]+)"')
IMPORT = re.compile(r'(?:^|\n)\s*(?:import|export)\b[^;]*?from\s+"(\.[^"]+)"|(?:^|\n)import\s+"(\.[^"]+)"')


def test_the_first_page_is_light_and_asks_no_other_site(web: Running) -> None:
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
