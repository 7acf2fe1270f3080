"""Source digests as code versions, so that results of other code versions are not reused.

The code of a package is its own files and all modules of the core that they import, directly or through others. A module named
in a string counts as imported: a backend ("module:Class"), a child process. The names are found by a regular expression, as
parsing the core takes a hundred times as long.
"""

import hashlib
import re
from functools import cache
from pathlib import Path

from r2c2r_core.plugins import GROUPS, Group, plugin_key

PACKAGE = Path(__file__).parent
_NAMED = re.compile(rf"\b{__package__}\.([\w.]+)(?: import (\([^)]*\)|.*))?")


def source_key(*roots: str) -> str:
    """Digest of the code of packages or modules ("ingest", "align.stage"), and of the plug-ins that add to it."""
    own, groups = _code(PACKAGE, roots)
    return hashlib.sha256("".join((own, *map(plugin_key, groups))).encode()).hexdigest()[:16]


@cache
def modules_of(*roots: str, package: Path = PACKAGE) -> frozenset[str]:
    """Paths in the core of the modules of packages or modules, and of all that they import, also within functions."""
    modules = _modules(package)
    waiting, found = [name for name in modules if any(f"{name}.".startswith(f"{root}.") for root in roots)], set[str]()
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += _named(package, name)
    return frozenset(found)


def source_files(package: Path) -> list[Path]:
    """The files of a package, except compiled and hidden ones."""
    files = (path for path in package.rglob("*") if path.is_file())
    return sorted(p for p in files if not any(part[0] == "." or part == "__pycache__" for part in p.relative_to(package).parts))


@cache
def _code(package: Path, roots: tuple[str, ...]) -> tuple[str, tuple[Group, ...]]:
    """Digest of modules and of the other files of their packages (pages, networks), and the plug-in groups that they read."""
    names = modules_of(*roots, package=package)
    modules, rooms = {_modules(package)[name] for name in names}, {name.partition(".")[0] for name in names}
    digest, read = hashlib.sha256(), ""
    for path in source_files(package):
        if path in modules or (path.suffix != ".py" and path.relative_to(package).parts[0] in rooms):
            digest.update(path.read_bytes())
        if path in modules and path.stem != "plugins":  # which lists all groups
            read += path.read_text(encoding="utf-8")
    return digest.hexdigest(), tuple(group for group in GROUPS if f'"{group}"' in read)


@cache
def _modules(package: Path) -> dict[str, Path]:
    """The modules of the core by path; a package is its __init__.py."""
    files = (path for path in source_files(package) if path.suffix == ".py")
    return {".".join(path.relative_to(package).with_suffix("").parts).removesuffix(".__init__"): path for path in files}


@cache
def _named(package: Path, name: str) -> tuple[str, ...]:
    """The modules that a module imports or names in a string, with the packages that contain them."""
    text, modules = _modules(package)[name].read_text(encoding="utf-8"), _modules(package)
    imported = (
        f"{path}.{part}".split(".") for path, parts in _NAMED.findall(text) for part in ("", *re.findall(r"\w+", parts))
    )
    found = {".".join(parts[:depth]) for parts in imported for depth in range(1, len(parts) + 1)}
    return tuple(found & modules.keys())
