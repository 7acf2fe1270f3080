"""`r2c2r doctor`: capabilities of this machine, and commands that fix missing ones."""

import ctypes.util
import os
import shutil
import socket
import sys
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Literal

from r2c2r_core.alone import network_can_be_left
from r2c2r_core.disk import open_to_others
from r2c2r_core.registry import Backend, Registry

OPEN3D_LIBRARIES = ("EGL", "GL", "X11", "usb-1.0", "udev", "idn2")
"""Without any of these `import open3d` fails (measured by hiding each)."""
OPEN3D_PACKAGES = "libegl1 libgl1 libx11-6 libusb-1.0-0 libudev1 libidn2-0"

_LOW_DISK_BYTES = 5e9  # a 180-frame project takes about 1 GB


@dataclass(frozen=True, slots=True)
class MachineFinding:
    """One line of the doctor's table."""

    what: str
    state: Literal["ok", "absent", "problem"]
    detail: str

    def to_json(self) -> dict[str, str]:
        """The finding as a JSON object."""
        return asdict(self)


def examine_machine(data_dir: Path) -> list[MachineFinding]:
    """Findings on system libraries, backends with their licences, loaders, GPU, default port, free disk, privacy."""
    return [
        MachineFinding("python", "ok", sys.version.split()[0]),
        _system_libraries(),
        *_backends(),
        *_plugins(),
        *_loaders(),
        _gpu(),
        _port(8000),
        _disk(data_dir),
        _privacy(data_dir),
        _decoders(),
    ]


def missing_libraries() -> list[str]:
    """Names of libraries that Open3D needs and this machine lacks."""
    if not sys.platform.startswith("linux"):
        return []
    return [name for name in OPEN3D_LIBRARIES if ctypes.util.find_library(name) is None]


def _system_libraries() -> MachineFinding:
    missing = missing_libraries()
    if missing:
        detail = f"lacks {', '.join(missing)}: sudo apt-get install -y {OPEN3D_PACKAGES}"
        return MachineFinding("system libraries", "problem", detail)
    return MachineFinding("system libraries", "ok", "all that Open3D needs")


def _backends() -> list[MachineFinding]:
    from r2c2r_core.align.protocol import MATCHERS
    from r2c2r_core.generate.stage import GENERATORS
    from r2c2r_core.segment.stage import SEGMENTERS
    from r2c2r_core.synthesize.fixtures.carcass import CARCASSES

    registries: tuple[Registry[Any], ...] = (SEGMENTERS, GENERATORS, MATCHERS, CARCASSES)
    findings = []
    for registry in registries:
        for backend in registry.backends:
            ready, reason = registry.available(backend.name)
            detail = f"{reason}; licence: {backend.licence}"
            findings.append(MachineFinding(f"{registry.seam} {backend.name}", "ok" if ready else "absent", detail))
    return findings


def _plugins() -> list[MachineFinding]:
    """One finding per plug-in, with the reason if it does not load."""
    from r2c2r_core.export.writers.table import Format
    from r2c2r_core.ingest.readers.protocol import Reader
    from r2c2r_core.kitchen.category import Category
    from r2c2r_core.plugins import GROUPS, plugins

    kinds: dict[str, type] = {"r2c2r.readers": Reader, "r2c2r.fixtures": Category, "r2c2r.formats": Format}
    return [
        MachineFinding(
            f"plug-in {plugin.name}",
            "problem" if plugin.fault else "ok",
            f"{plugin.group}, {plugin.package}{f': {plugin.fault}' if plugin.fault else ''}",
        )
        for group in GROUPS
        for plugin in plugins(group, kinds.get(group, Backend))
    ]


def _loaders() -> list[MachineFinding]:
    from r2c2r_core.export.loaders import APART

    findings = []
    for package, hint in (
        ("mujoco", ""),
        ("yourdfpy", ""),
        ("usd-core", "pip install usd-core"),
        ("pybullet", "pip install 'r2c2r[bullet]'"),
    ):
        try:
            findings.append(MachineFinding(f"loader {package}", "ok", version(package)))
        except PackageNotFoundError:
            findings.append(MachineFinding(f"loader {package}", "absent", hint))
    return [*findings, *(_environment(name, own.variable) for name, own in APART.items())]


def _environment(loader: str, variable: str) -> MachineFinding:
    """Finding on the separate Python environment of a loader."""
    python = os.environ.get(variable)
    if not python:
        hint = f"install it in an environment of its own and set {variable} to its python"
        return MachineFinding(f"loader {loader}", "absent", hint)
    if not Path(python).is_file():
        return MachineFinding(f"loader {loader}", "problem", f"{variable} is {python}, which does not exist")
    return MachineFinding(f"loader {loader}", "ok", python)


def _gpu() -> MachineFinding:
    driver = shutil.which("nvidia-smi")
    return MachineFinding("gpu", "ok" if driver else "absent", driver or "none needed: every stage runs on the CPU")


def _port(port: int) -> MachineFinding:
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return MachineFinding(f"port {port}", "absent", "taken: use r2c2r serve --port")
    return MachineFinding(f"port {port}", "ok", "free")


def _disk(data_dir: Path) -> MachineFinding:
    existing = next(folder for folder in (data_dir, *data_dir.parents) if folder.exists())
    free = shutil.disk_usage(existing).free
    state: Literal["ok", "problem"] = "ok" if free > _LOW_DISK_BYTES else "problem"
    return MachineFinding("disk", state, f"{free / 1e9:.1f} GB free at {existing}")


def _privacy(data_dir: Path) -> MachineFinding:
    """Finding on access of other users to the data folder."""
    existing = next(folder for folder in (data_dir, *data_dir.parents) if folder.exists())
    if not (existing.is_dir() and os.access(existing, os.W_OK)):
        detail = f"{data_dir} cannot be written or made in {existing}: set R2C2R_DATA, or give --data"
        return MachineFinding("data folder", "problem", detail)
    if existing != data_dir:
        return MachineFinding("data folder", "ok", f"{data_dir} does not exist yet: the first start makes it")
    mode = open_to_others(data_dir)
    if mode:
        return MachineFinding("data folder", "problem", f"other users have access ({mode}): chmod go= {data_dir}")
    return MachineFinding("data folder", "ok", f"only its owner has access to {data_dir}")


def _decoders() -> MachineFinding:
    """Finding on network isolation of the decoders of uploads."""
    if network_can_be_left():
        return MachineFinding("decoders", "ok", "uploads are decoded without network access")
    detail = "uploads are decoded with network access: no process can be isolated on this system (unshare, Linux only)"
    return MachineFinding("decoders", "absent", detail)
