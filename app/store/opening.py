"""Selection of the store of projects' files from the settings."""

from app.settings import Settings
from app.store.mirror import Mirror
from app.store.objects import open_objects
from app.store.protocol import Folder, Store


def open_store(settings: Settings) -> Store:
    """The data folder, or an object store of which it is a cache; raises as `open_objects` does."""
    if not settings.store:
        return Folder(settings.data_dir / "projects")
    return Mirror(open_objects(settings.store), settings.data_dir, settings.cache_bytes)
