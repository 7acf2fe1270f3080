"""Mutated inputs: valid ones of every kind, changed in one or a few places by a seeded generator.

Structured text is mutated as a structure (a value of another type or size, a key removed, duplicated or unknown), archives by
their members, folders by their files, everything as bytes; paths and numbers on the command line are replaced.
"""

import json
import os
import pkgutil
import random
import shutil
import string
import sys
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from r2c2r_core import commands
from tests.core.export.conftest import write_folder
from tests.core.export.kitchen import kitchen
from tests.core.ingest.test_damage import FOLDERS
from tests.core.ingest.tiny import TinyRoom, write_r3d, zip_folder
from tests.core.ingest.tiny_formats import write_nerfstudio

ROOM = TinyRoom(count=3)


_COMMANDS = {module.name.replace("_", "-") for module in pkgutil.iter_modules(commands.__path__)}


@dataclass(frozen=True, slots=True)
class Case:
    """One command and its arguments; `run` names the process that takes them."""

    run: str  # "cli", "worker" or "probe"
    kind: str  # of input
    arguments: tuple[str, ...]

    @property
    def command(self) -> str:
        """The command's name, for the counts."""
        if self.run != "cli":
            return self.run
        first = self.arguments[0] if self.arguments else ""
        return first if first in _COMMANDS else "no command"


class Inputs:
    """Valid inputs of every kind, made once."""

    def __init__(self, folder: Path) -> None:
        self.recordings = {name: write(folder / name, ROOM) for name, write in FOLDERS.items()}
        self.recordings["nerfstudio-npy"] = write_nerfstudio(folder / "npy", ROOM, npy=True)
        self.archives = {"r3d": write_r3d(folder / "scan.r3d", ROOM)}
        self.archives |= {
            f"{name}-zip": zip_folder(self.recordings[name], folder / f"{name}.zip", top="scan/") for name in ("stray", "tum")
        }
        self.bundle = write_folder(kitchen(), folder / "bundle")
        self.bundle_zip = zip_folder(self.bundle, folder / "bundle.zip")
        manifest = json.loads((self.bundle / "manifest.json").read_text())
        self.documents: dict[str, Any] = {
            "prompts": _PROMPTS,
            "overrides": _OVERRIDES,
            "config": _CONFIG,
            "truth": {"objects": manifest["objects"]},
            "manifest": manifest,
            "request": {"source": "scan.r3d", "prompts": "prompts.json", "seed": 1, "tools": {"matcher": "sift"}},
        }
        self.meshes = _meshes(folder)


def case_of(inputs: Inputs, folder: Path, seed: int, number: int) -> Case:
    """Case `number` of a seed; its files are written into the folder."""
    rng = random.Random(f"{seed}:{number}")
    maker = rng.choices([maker for maker, _ in MAKERS], [weight for _, weight in MAKERS])[0]
    return maker(inputs, folder, rng)


def _documents(inputs: Inputs, folder: Path, rng: random.Random) -> Case:
    """prompts, overrides, config: each is read before the recording, which is invalid."""
    kind = rng.choice(("prompts", "overrides", "config"))
    files = {name: _written(inputs.documents[name], folder / f"{name}.json") for name in ("prompts", "overrides", "config")}
    _damaged_json(inputs.documents[kind], files[kind], rng)
    (folder / "scan.r3d").write_bytes(b"")
    options = [word for name in ("overrides", "config") for word in (f"--{name}", str(files[name]))]
    words = ("run", str(folder / "scan.r3d"), "--prompts", str(files["prompts"]), "-o", str(folder / "b.zip"), *options)
    return Case("cli", kind, words)


def _request(inputs: Inputs, folder: Path, rng: random.Random) -> Case:
    (folder / "scan.r3d").write_bytes(b"")
    _written(inputs.documents["prompts"], folder / "prompts.json")
    _damaged_json(inputs.documents["request"], folder / "request.json", rng)
    return Case("worker", "request", (str(folder),))


def _truth(inputs: Inputs, folder: Path, rng: random.Random) -> Case:
    bundle, truth = folder / "bundle", _written(inputs.documents["truth"], folder / "truth.json")
    bundle.mkdir()
    manifest = _written(inputs.documents["manifest"], bundle / "manifest.json")
    kind = rng.choice(("truth", "manifest"))
    _damaged_json(inputs.documents[kind], truth if kind == "truth" else manifest, rng)
    return Case("cli", kind, ("evaluate", str(bundle), "--truth", str(truth)))


def _bundle(inputs: Inputs, folder: Path, rng: random.Random) -> Case:
    if rng.random() < 0.5:
        damaged = _damaged_archive(inputs.bundle_zip, folder / "bundle.zip", rng)
        return Case("cli", "bundle zip", ("check", str(damaged)))
    bundle = Path(shutil.copytree(inputs.bundle, folder / "bundle"))
    _damaged_folder(bundle, rng)
    return Case("cli", "bundle folder", ("check", str(bundle)))


def _recording(inputs: Inputs, folder: Path, rng: random.Random) -> Case:
    if rng.random() < 0.3:
        name = rng.choice(sorted(inputs.archives))
        damaged = _damaged_archive(inputs.archives[name], folder / inputs.archives[name].name, rng)
    else:
        name = rng.choice(sorted(inputs.recordings))
        damaged = Path(shutil.copytree(inputs.recordings[name], folder / "scan"))
        for _ in range(rng.choice((1, 1, 3))):
            _damaged_folder(damaged, rng)
    if rng.random() < 0.15:
        return Case("cli", name, ("info", str(damaged)))
    return Case("probe", name, ("recording", str(damaged), damaged.name))


def _mesh(inputs: Inputs, folder: Path, rng: random.Random) -> Case:
    suffix = rng.choice(sorted(inputs.meshes))
    path = folder / f"mesh{suffix}"
    path.write_bytes(_damaged(inputs.meshes[suffix], rng))
    return Case("probe", f"mesh {suffix}", ("mesh", str(path), path.name))


def _paths(inputs: Inputs, folder: Path, rng: random.Random) -> Case:
    """A path to no such file, to something that is not a file, or that is not a path."""
    (folder / "empty").write_bytes(b"")
    (folder / "folder").mkdir()
    os.mkfifo(folder / "pipe")
    (folder / "loop").symlink_to(folder / "loop")
    prompts = _written(inputs.documents["prompts"], folder / "prompts.json")
    tails = ("nothing", "empty", "folder", "pipe", "loop", "empty/x", "n" * 300, "\udcff", "a\nb", "\u202ex", "x/" * 3000)
    odd = rng.choice([*(f"{folder}/{tail}" for tail in tails), "", ".", "/dev/null", "/dev/zero", "/proc/self/mem", "~", "-"])
    out = str(folder / "out.zip")
    lines = (
        ("info", odd),
        ("check", odd),
        ("dataset", odd, "-o", out),
        ("evaluate", odd, "--truth", str(prompts)),
        ("evaluate", str(inputs.bundle), "--truth", odd),
        ("evaluate", str(inputs.bundle), "--truth", str(prompts), "--masks", odd),
        ("run", odd, "--prompts", str(prompts), "-o", out),
        ("run", str(folder / "empty"), "--prompts", odd, "-o", out),
        ("run", str(folder / "empty"), "--prompts", str(prompts), "-o", out, "--overrides", odd),
        ("run", str(folder / "empty"), "--prompts", str(prompts), "-o", out, "--config", odd),
        ("run", str(folder / "empty"), "--prompts", str(prompts), "-o", odd),
        ("run", str(folder / "empty"), "--prompts", str(prompts), "-o", f"{odd}.zip"),
        ("info", str(inputs.archives["r3d"]), "--overrides", odd),
        ("serve", "--host", "256.0.0.1", "--data", odd),
        ("user", "list", "--data", odd),
    )
    return Case("cli", "path", rng.choice([line for line in lines if not (odd in ("", ".", "~", "-") and "--data" in line)]))


def _numbers(inputs: Inputs, folder: Path, rng: random.Random) -> Case:
    """A number on the command line; servers get an invalid address, so that none of them starts."""
    odd = rng.choice(
        ("-1", "99999", "65536", "9" * 5000, "1e9", "nan", "", " ", "0x10", "١٢", "٣x٤", "1_0", "-0", "½", "\udcff")
    )
    data = ("--data", str(folder / "data"))
    prompts = _written(inputs.documents["prompts"], folder / "prompts.json")
    run = ("run", str(prompts), "--prompts", str(prompts), "-o", str(folder / "b.zip"))
    host = rng.choice(("256.0.0.1", "a" * 300, "::::", "\udcff", "a..b", "%", "[::1", "1.2.3"))
    lines = (
        ("serve", "--port", odd, "--host", "256.0.0.1", *data),
        ("serve", "--host", host, *data),
        ("serve", "--jobs", odd, "--host", "256.0.0.1", *data),
        ("serve", "--max-upload", odd, "--host", "256.0.0.1", *data),
        ("demo", "--port", f"x{odd}", *data),
        ("sample", str(folder / "s"), "--seed", f"-{odd}"),
        ("sample", str(folder / "s"), "--frames", f"-{odd}"),
        ("sample", str(folder / "s"), "--size", f"{odd}x64x"),
        (*run, "--seed", odd),
        (*run, "--segmenter", odd),
        (*run, "--generator", odd),
        (*run, "--matcher", odd),
        ("user", "add", odd, *data),
        ("user", "role", "nobody", odd, *data),
        ("schema", odd),
        (odd, *data),
    )
    return Case("cli", "argument", rng.choice(lines))


MAKERS: tuple[tuple[Callable[[Inputs, Path, random.Random], Case], float], ...] = (
    (_documents, 30),
    (_truth, 15),
    (_recording, 25),
    (_request, 5),
    (_paths, 10),
    (_numbers, 8),
    (_mesh, 5),
    (_bundle, 2),
)

_POINT = {"frame": 1, "x": 10.0, "y": 12.5, "label": 1}
_PROMPTS = {
    "version": 1,
    "objects": [
        {"name": "drawer_1", "category": "drawer", "points": [_POINT, {**_POINT, "label": 0}]},
        {"name": "mug", "category": "mug", "points": [_POINT]},
    ],
}
_OVERRIDES = {
    "version": 1,
    "objects": {
        "drawer_1": {
            "candidate": "c2",
            "hinge": "left",
            "dimensions_m": [0.5, 0.6, 0.7],
            "pose": np.eye(4).tolist(),
            "joint_limits": [0, 1.5],
            "joints": {"left_door": [None, 1.0]},
            "front": [0, -1, 0],
            "rejected": ["c1"],
            "regenerate": 1,
        }
    },
    "scene": {"up": [0, 1, 0], "floor": 0.1, "manhattan_yaw": 0.2, "walls": [[1, 0, -2]]},
}
_CONFIG = {
    "ingest": {"most_frames": 100, "near_m": 0.1, "seed": 3},
    "segment": {"fusion": "evidence", "cell_m": 0.003},
    "generate": {"count": 2, "rule": "mean"},
    "warp": {"method": "axes", "front_scale": [0.7, 1.4]},
    "export": {"pictures": False},
}
_RAW = (
    "9" * 5000,
    "1e400",
    "-1e400",
    "NaN",
    "Infinity",
    "0." + "1" * 3000,
    "[" * 3000 + "]" * 3000,
    '"\\ud800"',
    '{"a":1,"a":2}',
)
_VALUES: tuple[Any, ...] = (
    None, True, False, 0, 1, -1, 2**31, 2**63, 10**30, -(10**30), 0.0, -0.0, 1e-300, 1e300, 1e9, 1e12, 5.5,
    "", " ", "c1", "n" * 300, "n" * 100_000, "\x00", "\x1b[31m", "\u202e", "../../etc/passwd", "/dev/zero", "1", "nan",
    [], {}, [1], [[1]], [None], [1, 2, 3], [1e9] * 3, [[0] * 4] * 4, {"name": {}}, {"a": 1}, [5] * 1000, [[[[1]]]],
)  # fmt: skip
_WORDS = (
    b"",
    b"nan",
    b"inf",
    b"-1e308",
    b"1e308",
    b"9" * 400,
    b"9" * 200_000,
    b"-1",
    b"0",
    b"e",
    b"+",
    b"\xff",
    b"a,b",
    b"\x00",
    b"\n",
)
_NAMES = ("1000000000000", "9" * 200, "-1", "0" * 40, "..", "../x", "/etc/x", "a\nb", "\u202ex", "x" * 200, "", "CON", "1.5")


def _written(document: Any, path: Path) -> Path:
    path.write_text(json.dumps(document))
    return path


def _damaged_json(document: Any, path: Path, rng: random.Random) -> None:
    if rng.random() < 0.2:
        path.write_bytes(_damaged(json.dumps(document).encode(), rng))
        return
    changed, raw = json.loads(json.dumps(document)), rng.choice(_RAW)
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        changed = _changed(changed, rng)
    path.write_text(json.dumps(changed).replace('"@raw"', raw).replace('"@key"', '"version"'))


def _changed(value: Any, rng: random.Random) -> Any:
    """The same value with one place, at any depth, replaced."""
    if isinstance(value, dict) and value and rng.random() < 0.9:
        key = rng.choice(sorted(value))
        how = rng.random()
        if how < 0.1:
            return {k: v for k, v in value.items() if k != key}
        if how < 0.15:
            return {**value, rng.choice(("@key", "unknown", "", "n" * 300, "\udcff")): value[key]}
        return {**value, key: _changed(value[key], rng)}
    if isinstance(value, list) and value and rng.random() < 0.9:
        at = rng.randrange(len(value))
        if rng.random() < 0.2:
            return rng.choice((value[:at], value * 2, value + [value[at]] * 200, value[::-1]))
        return [*value[:at], _changed(value[at], rng), *value[at + 1 :]]
    return rng.choice((*_VALUES, "@raw", "@raw", "@raw"))


def _damaged(content: bytes, rng: random.Random) -> bytes:
    """The bytes cut, flipped, repeated, or with one word replaced."""
    at = rng.randrange(len(content) + 1)
    how = rng.randrange(9)
    if how == 0:
        return content[:at]
    if how == 1:
        return rng.choice((b"", b"\x00" * len(content), rng.randbytes(min(len(content), 4000)), b"[" * 100_000, b"\xff\xfe"))
    if how == 2:
        return content[:at] + rng.randbytes(rng.randrange(1, 9)) + content[at:]
    if how == 3:
        return content[:at] + content[at : at + 100] * rng.randrange(2, 50) + content[at + 100 :]
    if how < 6 and (words := content.replace(b",", b" ").split()) and len(content) < 200_000:
        word = rng.choice(words)
        return content.replace(word, rng.choice(_WORDS), rng.choice((1, 1, -1)))
    flipped = bytearray(content)
    for _ in range(rng.choice((1, 1, 4, 30))):
        if flipped:  # most formats have their type at the start
            place = rng.randrange(min(len(flipped), 64)) if rng.random() < 0.5 else rng.randrange(len(flipped))
            flipped[place] = rng.choice((0, 255, flipped[place] ^ 1 << rng.randrange(8)))
    return bytes(flipped)


def _damaged_folder(folder: Path, rng: random.Random) -> None:
    files = sorted(path for path in folder.rglob("*") if path.is_file() and not path.is_symlink())
    if not files:
        return
    sorts = sorted({(path.parent, path.suffix) for path in files})  # the one text is as likely as the hundred pictures
    sort = rng.choice(sorts)
    path = rng.choice([file for file in files if (file.parent, file.suffix) == sort])
    how = rng.random()
    if how < 0.75:
        content = path.read_bytes()
        is_json = content[:1] == b"{" and rng.random() < 0.7
        if is_json:
            try:
                _damaged_json(json.loads(content), path, rng)
            except (ValueError, RecursionError):  # already damaged: cut short, or nested 100,000 deep
                path.write_bytes(_damaged(content, rng))
        else:
            path.write_bytes(_damaged(content, rng))
        return
    path.unlink()
    if how < 0.80:
        os.mkfifo(path)
    elif how < 0.84:
        path.mkdir()
    elif how < 0.88:
        path.symlink_to(rng.choice(("/etc/passwd", "/dev/zero", str(path), "nothing")))
    elif how < 0.96:
        digits = "".join(rng.choice(string.digits) for _ in range(rng.choice((3, 12, 120))))
        path.with_name(f"{rng.choice((digits, 'frame-' + digits))}{path.suffix}").write_bytes(b"")


def _damaged_archive(source: Path, target: Path, rng: random.Random) -> Path:
    if rng.random() < 0.3:
        target.write_bytes(_damaged(source.read_bytes(), rng))
        return target
    with zipfile.ZipFile(source) as old:
        members = {info.filename: old.read(info) for info in old.infolist() if not info.is_dir()}
    sorts = sorted({name.rpartition(".")[2] for name in members})
    sort = rng.choice(sorts)
    name = rng.choice(sorted(name for name in members if name.rpartition(".")[2] == sort))
    content = members.pop(name)
    how = rng.random()
    if how < 0.5:
        members[name] = _damaged(content, rng)
    elif how < 0.9:
        folder, _, file = name.rpartition("/")
        members[f"{folder}/{rng.choice(_NAMES)}.{file.rpartition('.')[2]}"] = content
    with zipfile.ZipFile(target, "w") as new:
        for member, inside in members.items():
            new.writestr(member, inside)
    return target


def _meshes(folder: Path) -> dict[str, bytes]:
    import trimesh

    box = trimesh.creation.box((0.3, 0.2, 0.1))
    made = {}
    for suffix in (".glb", ".obj", ".ply", ".stl"):
        box.export(folder / f"box{suffix}")
        made[suffix] = (folder / f"box{suffix}").read_bytes()
    return made
