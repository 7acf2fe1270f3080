"""The app with stand-ins for its slow parts."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from fastapi import FastAPI

from app import serve
from app.main import create_app
from app.settings import Settings
from app.viewer.client import Viewer
from tests.app.conftest import FAKE_COMMANDS, fake


def serve_stand_in(*, data_dir: Path, port: int, live: str, scenes: bool, names: Sequence[str]) -> None:
    """Serve it until stopped; `live` is the live segmenter among tests/app/fakes; accounts are needed if there are names.

    Without `scenes`, 3D views are empty: their client would be loaded for seconds, and drawn by the CPU.
    """

    def create(settings: Settings) -> FastAPI:
        viewer = None if scenes else Viewer(settings, fake("viewer"))
        return create_app(settings, commands=replace(FAKE_COMMANDS, live=fake(live)), viewer_client=viewer)

    vars(serve)["create_app"] = create
    serve.serve(host="127.0.0.1", port=port, data_dir=data_dir, names=names)
