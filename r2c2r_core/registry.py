"""Registry of backends by name ("module:Class" strings, loaded on first use), and location of their weights."""

import importlib
import importlib.util
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, Literal, TypeVar, cast

from r2c2r_core.errors import BackendUnavailable, InputError
from r2c2r_core.plugins import Group, added

T = TypeVar("T")

LicenceClass = Literal["open", "restricted"]  # restricted: gated, non-commercial, or bound to a field of use
MODEL_FILES = ("config.json", "*.safetensors")  # the files of a transformers model


@dataclass(frozen=True, slots=True, kw_only=True)
class Weights:
    """Weights of a learned backend: a folder or a hub id named by the user, else the default id."""

    usual: str  # a hub id
    variable: str  # environment variable that names a folder or another hub id
    gated: bool = False  # the hub requires accepting a licence first
    holds: tuple[str, ...] = MODEL_FILES  # patterns of files that identify such a model's folder


@dataclass(frozen=True, slots=True, kw_only=True)
class Backend:
    """One row of a stage's table of backends."""

    name: str
    target: str  # "module:Class"
    extra: str | None = None  # the extra of pyproject.toml that brings its libraries
    needs: tuple[str, ...] = ()  # modules that must be importable
    install: str = ""  # how to install them where neither an extra nor a plain name suffices
    weights: Weights | None = None
    server: str = ""  # environment variable that names its server, for a remote backend
    licence: str = "Apache-2.0 (this project)"
    licence_class: LicenceClass = "open"
    summary: str = ""

    @property
    def alone(self) -> bool:
        """Whether a single process must do all the work, as each would load the weights or wait for the same server."""
        return self.weights is not None or bool(self.server)


@dataclass(frozen=True, slots=True)
class Registry(Generic[T]):
    """The backends of one seam, all of type T; the first needs no extra and is the default."""

    seam: str
    own: tuple[Backend, ...]
    protocol: type = object  # T at run time; a backend must have its abstract methods
    setting: str = "segment.weights"  # the setting that names the weights
    group: Group | None = None  # of entry points, by which other packages add to it

    @property
    def backends(self) -> tuple[Backend, ...]:
        """The project's own backends, then those of other packages; an added one cannot replace an existing name."""
        taken = {backend.name for backend in self.own}
        further = added(self.group, Backend) if self.group is not None else ()
        return (*self.own, *(backend for backend in further if backend.name not in taken))

    @property
    def default(self) -> str:
        """Name of the backend used by default."""
        return self.own[0].name

    def get(self, name: str) -> Backend:
        """The backend called `name`; raises InputError naming the choices."""
        for backend in self.backends:
            if backend.name == name:
                return backend
        choices = ", ".join(b.name for b in self.backends)
        raise InputError(f"unknown {self.seam} '{name}'", hint=f"choose one of: {choices}")

    def available(self, name: str, weights: str = "") -> tuple[bool, str]:
        """Whether the backend's libraries and weights are here, and the next step if not; imports nothing heavy."""
        try:
            self.require(name, weights)
        except BackendUnavailable as error:
            return False, f"{error.message.partition(': ')[2]}: {error.hint}"
        server = self.get(name).server
        if server and not os.environ.get(server):
            return False, f"no server configured: set {server}"
        return True, "ready"

    def require(self, name: str, weights: str = "") -> Path | None:
        """The folder of the backend's weights (None when it needs none); raises BackendUnavailable with the next step.

        `weights` names a folder or a hub id; empty takes the backend's variable, then its usual id.
        """
        backend = self.get(name)
        missing = [m for m in backend.needs if importlib.util.find_spec(m) is None]
        if missing:
            step = (
                f"pip install 'r2c2r[{backend.extra}]'" if backend.extra else f"install {backend.install or ', '.join(missing)}"
            )
            raise BackendUnavailable(f"{self.seam} '{name}' is not available: missing {', '.join(missing)}", hint=step)
        if backend.weights is None:
            return None
        named = self.weights_named(name, weights)
        folder = find_weights(named, backend.weights.holds)
        if folder is None:
            raise BackendUnavailable(
                f"{self.seam} '{name}' is not available: no weights at {named}",
                hint=_how_to_get(backend.weights, named, self.setting),
            )
        return folder

    def weights_named(self, name: str, weights: str = "") -> str:
        """The folder or hub id that the backend's weights come from; empty when it needs none."""
        wanted = self.get(name).weights
        return "" if wanted is None else weights or os.environ.get(wanted.variable) or wanted.usual

    def load(self, name: str, **options: Any) -> T:
        """A new instance of the backend; raises BackendUnavailable with the extra to install or the weights to fetch.

        A backend with weights gets their folder as `weights`. One that does not satisfy the seam's protocol is refused here.
        """
        folder = self.require(name, options.pop("weights", ""))
        if folder is not None:
            options["weights"] = folder
        return self._class_of(name)(**options)

    def _class_of(self, name: str) -> Callable[..., T]:
        """The backend's class, checked to have every method of the protocol; raises BackendUnavailable."""
        target = self.get(name).target
        module_name, _, class_name = target.partition(":")
        found = getattr(importlib.import_module(module_name), class_name, None)
        asked = sorted(getattr(self.protocol, "__abstractmethods__", ()))
        lacking = [method for method in asked if not _is_written(getattr(found, method, None))]
        if found is None or lacking:
            fault = "not found" if found is None else f"it has no {' and no '.join(lacking)}"
            raise BackendUnavailable(
                f"{self.seam} '{name}' is not available: {target}: {fault}",
                hint=f"expected a class with the methods of {self.protocol.__module__}.{self.protocol.__name__}",
            )
        return cast(Callable[..., T], found)


def find_weights(named: str, holds: tuple[str, ...] = MODEL_FILES) -> Path | None:
    """The folder that holds the weights called `named`, itself a folder or a hub id already downloaded; never downloads."""
    folder = Path(named).expanduser()
    if folder.is_dir():
        return folder if _is_model(folder, holds) else None
    repository = hub_cache() / f"models--{named.replace('/', '--')}"
    try:
        newest = (repository / "refs" / "main").read_text().strip()
        snapshots = [repository / "snapshots" / newest]
    except OSError:
        snapshots = sorted((repository / "snapshots").glob("*"))
    return next((snapshot for snapshot in snapshots if _is_model(snapshot, holds)), None)


def hub_cache() -> Path:
    """Download cache of Hugging Face's tools (HF_HUB_CACHE, HF_HOME, else the user's cache folder)."""
    home = os.environ.get("HF_HOME") or Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache") / "huggingface"
    return Path(os.path.expanduser(os.environ.get("HF_HUB_CACHE") or Path(home) / "hub"))  # a user may have no home folder


def _is_written(method: object) -> bool:
    return callable(method) and not getattr(method, "__isabstractmethod__", False)


def _is_model(folder: Path, holds: tuple[str, ...]) -> bool:
    return all(any(folder.glob(pattern)) for pattern in holds)


def _how_to_get(weights: Weights, named: str, setting: str) -> str:
    where = f"set {weights.variable} or {setting} to a folder or hub id"
    if Path(named).expanduser().is_absolute() or named.startswith("."):
        return f"expected a folder with {' and '.join(weights.holds)}; {where}"
    first = f"accept the licence at https://huggingface.co/{named} and log in (hf auth login), " if weights.gated else ""
    return f"{first}hf download {named}; or {where}"
