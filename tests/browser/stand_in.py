"""The app with stand-ins for its slow parts."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from app import serve
from app.main import create_app
from tests.app.conftest import FAKE_COMMANDS, fake


def serve_stand_in(data: Path, port: int, live: str, names: Sequence[str]) -> None:
    """Serve it until stopped; `live` is the live segmenter among tests/app/fakes; accounts are needed if there are names."""
    vars(serve)["create_app"] = partial(create_app, commands=replace(FAKE_COMMANDS, live=fake(live)))
    serve.serve(host="127.0.0.1", port=port, data_dir=data, names=names)
