"""Serialisation of nouns: one zip per noun, with JSON for the structure and one member per array. No pickle, no code."""

import dataclasses
import io
import json
import zipfile
from collections.abc import Mapping
from functools import cache
from typing import Any

import cv2
import numpy as np

from r2c2r_core.geometry import camera, masks, transforms
from r2c2r_core.model import capture, inputs, mesh, motion, placement, reconstruction, report, scene, track

_MODULES = (camera, masks, transforms, capture, inputs, mesh, motion, placement, reconstruction, report, scene, track)


Classes = Mapping[str, type]


def encode_noun(noun: object, header: Mapping[str, Any], more: tuple[type, ...] = ()) -> bytes:
    """Zip bytes of a dataclass of the model, or of `more`, with a small JSON header."""
    blobs: list[tuple[str, bytes]] = []
    structure = {"header": dict(header), "noun": _encode(noun, blobs, _named(more))}
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr("noun.json", json.dumps(structure))
        for name, content in blobs:
            stored = name.endswith(".png")  # already compressed
            archive.writestr(name, content, zipfile.ZIP_STORED if stored else zipfile.ZIP_DEFLATED)
    return buffer.getvalue()


def decode_noun(content: bytes, more: tuple[type, ...] = ()) -> tuple[Any, dict[str, Any]]:
    """The noun and its header; raises ValueError, KeyError or zipfile.BadZipFile on anything else."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        structure = json.loads(archive.read("noun.json"))
        return _decode(structure["noun"], archive, _named(more)), structure["header"]


def decode_header(path_or_file: Any) -> dict[str, Any]:
    """The header of a stored noun, without reading its arrays."""
    with zipfile.ZipFile(path_or_file) as archive:
        header: dict[str, Any] = json.loads(archive.read("noun.json"))["header"]
        return header


def _encode(value: Any, blobs: list[tuple[str, bytes]], classes: Classes) -> Any:
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return {"array": _store_array(value, blobs)}
    if isinstance(value, bytes):
        return {"bytes": _store(value, "bin", blobs)}
    if isinstance(value, tuple | list):
        return {"tuple": [_encode(item, blobs, classes) for item in value]}
    if isinstance(value, dict):
        return {"dict": [[_encode(key, blobs, classes), _encode(item, blobs, classes)] for key, item in value.items()]}
    if dataclasses.is_dataclass(value) and classes.get(type(value).__name__) is type(value):
        fields = {f.name: _encode(getattr(value, f.name), blobs, classes) for f in dataclasses.fields(value) if f.init}
        return {"class": type(value).__name__, "fields": fields}
    raise TypeError(f"{type(value).__name__} is not a noun of the model")


def _decode(value: Any, archive: zipfile.ZipFile, classes: Classes) -> Any:
    if not isinstance(value, dict):
        return value
    if "array" in value:
        return _load_array(value["array"], archive)
    if "bytes" in value:
        return archive.read(value["bytes"])
    if "tuple" in value:
        return tuple(_decode(item, archive, classes) for item in value["tuple"])
    if "dict" in value:
        return {_decode(key, archive, classes): _decode(item, archive, classes) for key, item in value["dict"]}
    fields = {name: _decode(item, archive, classes) for name, item in value["fields"].items()}
    return classes[value["class"]](**fields)


def _store(content: bytes, suffix: str, blobs: list[tuple[str, bytes]]) -> str:
    name = f"{len(blobs)}.{suffix}"
    blobs.append((name, content))
    return name


def _store_array(array: np.ndarray, blobs: list[tuple[str, bytes]]) -> str:
    if array.dtype == np.uint8 and array.ndim == 3 and array.shape[2] == 3 and array.size:
        written, png = cv2.imencode(".png", np.ascontiguousarray(array[..., ::-1]), [cv2.IMWRITE_PNG_COMPRESSION, 1])
        if written:
            return _store(png.tobytes(), "png", blobs)
    buffer = io.BytesIO()
    np.save(buffer, array, allow_pickle=False)
    return _store(buffer.getvalue(), "npy", blobs)


def _load_array(name: str, archive: zipfile.ZipFile) -> np.ndarray:
    content = archive.read(name)
    if name.endswith(".png"):
        image = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR)
        if image is None:
            raise ValueError(f"{name} is not a PNG")
        return np.ascontiguousarray(image[..., ::-1])
    return np.asarray(np.load(io.BytesIO(content), allow_pickle=False))


@cache
def _named(more: tuple[type, ...]) -> Classes:
    model = {
        name: member
        for module in _MODULES
        for name, member in vars(module).items()
        if isinstance(member, type) and dataclasses.is_dataclass(member)
    }
    return model | {member.__name__: member for member in more}
