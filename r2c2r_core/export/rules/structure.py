"""Rules on names, the tree and joint types."""

from collections import Counter
from collections.abc import Iterator

from r2c2r_core.export.plan import WORLD
from r2c2r_core.export.reading import Urdf
from r2c2r_core.export.rules.table import finding
from r2c2r_core.model.report import Finding
from r2c2r_core.texts import IDENTIFIER

_WANTED = {"strippath": "false", "discardvisual": "false", "fusestatic": "false"}


def check_structure(urdf: Urdf) -> Iterator[Finding]:
    """Check numbers, names, one root, one tree, joint types, the <mujoco> block."""
    for where, text in urdf.malformed:
        yield finding("number", where, f"cannot read {text} as finite numbers")
    yield from _names(urdf)
    yield from _tree(urdf)
    for joint in urdf.joints:
        if joint.type not in ("revolute", "prismatic", "fixed", "continuous"):
            yield finding("joint-type", joint.name, f"type '{joint.type}'; use revolute, prismatic or fixed")
    missing = [key for key, value in _WANTED.items() if (urdf.mujoco_compiler or {}).get(key) != value]
    if missing:
        yield finding("mujoco-block", urdf.name, "<mujoco><compiler> lacks " + ", ".join(f'{k}="false"' for k in missing))


def _names(urdf: Urdf) -> Iterator[Finding]:
    for kind, names in (("link", [x.name for x in urdf.links]), ("joint", [x.name for x in urdf.joints])):
        for name, count in Counter(names).items():
            if count > 1:
                yield finding(f"duplicate-{kind}", name, f"{count} {kind}s have this name")
            if not IDENTIFIER.fullmatch(name):
                yield finding("name", name or f"a {kind}", f"{kind} names may hold letters, digits and _ only, no digit first")


def _tree(urdf: Urdf) -> Iterator[Finding]:
    links = {link.name for link in urdf.links}
    if urdf.roots != (WORLD,):
        found = ", ".join(urdf.roots) or "none (the joints form a cycle)"
        yield finding("root", urdf.name, f"root links are {found}; expected one, '{WORLD}'")
    parents = Counter(joint.child for joint in urdf.joints)
    for joint in urdf.joints:
        for role, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in links:
                yield finding("tree", joint.name, f"its {role} '{name}' is not a link")
        if parents[joint.child] > 1:
            yield finding("tree", joint.name, f"'{joint.child}' is the child of {parents[joint.child]} joints")
    unreached = links - set(urdf.world_poses())
    if unreached:
        yield finding("tree", sorted(unreached)[0], f"{len(unreached)} links are not connected to a root")
