"""Use a running server's API: python examples/drive_the_api.py ADDRESS (as `r2c2r serve` prints it, with its key)

Makes a sample kitchen, runs it and downloads the bundle. ADDRESS/api/openapi.json describes the whole API.
"""

import json
import sys
import time
from http.cookiejar import CookieJar
from typing import Any
from urllib.parse import urljoin
from urllib.request import HTTPCookieProcessor, Request, build_opener


def main(address: str) -> None:
    browser = build_opener(HTTPCookieProcessor(CookieJar()))
    browser.open(address).read()  # the printed key signs in one browser, once

    def api(path: str, body: dict[str, Any] | None = None) -> Any:
        content = None if body is None else json.dumps(body).encode()
        headers = {"Content-Type": "application/json", "X-Requested-With": "drive_the_api"}
        return json.loads(browser.open(Request(urljoin(address, path), content, headers)).read())

    project = api("/api/projects/sample", {"frames": 90})["id"]
    while (seen := api(f"/api/projects/{project}"))["status"] != "ready":
        print(seen["status"])
        time.sleep(0.2)
    named = [thing["name"] for thing in api(f"/api/projects/{project}/objects")]
    print(f"{project}: {', '.join(named)}")
    job = api(f"/api/projects/{project}/run", {})["id"]
    while (state := api(f"/api/jobs/{job}")["state"]) in ("queued", "running"):
        time.sleep(0.2)
    print(f"run {state}")
    newest = api(f"/api/projects/{project}/bundles")[0]
    content = browser.open(urljoin(address, f"/media/{project}/bundles/{newest['version']}.zip")).read()
    print(f"version {newest['version']}: {len(content)} bytes")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(*sys.argv[1:])
