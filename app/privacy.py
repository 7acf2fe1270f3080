"""Removal of server paths from messages, as only admins may see them; file names are kept."""

import re
import tempfile
from contextlib import suppress
from pathlib import Path

from app.settings import Settings


def without_places(text: str, settings: Settings) -> str:
    """The text with the server's folders removed from its paths."""
    places = {
        settings.data_dir,
        *settings.roots,
        Path(tempfile.gettempdir()),
        Path(__file__).parents[1],
    }
    for look_up in (Path.home, Path.cwd):
        with suppress(RuntimeError, OSError):  # this user has no home; the folder of the start is deleted
            places.add(look_up())
    for place in sorted({str(folder) for folder in places} - {"/"}, key=len, reverse=True):
        text = re.sub(rf"(?<!\w){re.escape(place)}(?![\w-])", "…", text)
    return text
