"""Slow imports and set-up of a served app, done at import: servers are forked from a process that has imported this."""

from pathlib import Path
from tempfile import TemporaryDirectory

from starlette.testclient import TestClient

import tests.app.served
import tests.browser.stand_in
from app.main import create_app
from app.settings import Settings

assert tests.app.served
assert tests.browser.stand_in
with TemporaryDirectory() as folder:  # the first request builds what every route needs
    browser = TestClient(create_app(Settings(data_dir=Path(folder))), base_url="http://127.0.0.1")
    assert browser.get("/static/js/main.js").is_success
