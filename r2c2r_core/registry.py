"""Backends by name: "module:Class" strings, loaded on first use, so that importing costs nothing."""

import importlib
import importlib.util
from dataclasses import dataclass
from typing import Any

from r2c2r_core.errors import BackendUnavailable, InputError


@dataclass(frozen=True, slots=True, kw_only=True)
class Backend:
    """One line of a stage's table."""

    name: str
    target: str  # "module:Class"
    extra: str | None = None  # the extra of pyproject.toml that brings its libraries
    needs: tuple[str, ...] = ()  # modules that must be importable
    licence: str = "Apache-2.0 (this project)"
    summary: str = ""


@dataclass(frozen=True, slots=True)
class Registry:
    """The backends of one seam; the first one needs no extra and is the default."""

    seam: str
    backends: tuple[Backend, ...]

    @property
    def default(self) -> str:
        """Name of the backend used when nobody chose one."""
        return self.backends[0].name

    def get(self, name: str) -> Backend:
        """The table's line called `name`; raises InputError naming the choices."""
        for backend in self.backends:
            if backend.name == name:
                return backend
        choices = ", ".join(b.name for b in self.backends)
        raise InputError(f"unknown {self.seam} '{name}'", hint=f"choose one of: {choices}")

    def available(self, name: str) -> tuple[bool, str]:
        """Whether the backend's libraries are importable, and the next step if not; imports nothing heavy."""
        backend = self.get(name)
        missing = [m for m in backend.needs if importlib.util.find_spec(m) is None]
        if not missing:
            return True, "ready"
        extra = f"pip install 'r2c2r[{backend.extra}]'" if backend.extra else f"install {', '.join(missing)}"
        return False, f"missing {', '.join(missing)}: {extra}"

    def load(self, name: str, **options: Any) -> Any:
        """A new instance of the backend; raises BackendUnavailable with the extra to install."""
        ready, reason = self.available(name)
        if not ready:
            raise BackendUnavailable(f"{self.seam} '{name}' is not available: {reason}")
        module_name, class_name = self.get(name).target.split(":")
        return getattr(importlib.import_module(module_name), class_name)(**options)
