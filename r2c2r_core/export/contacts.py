"""Bodies that overlap in a MuJoCo model, with its joints at given positions."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from r2c2r_core.robot.rig import find_contacts

ALLOWED_PENETRATION_M = 5e-4
CARRIED_BY = "carried_by"
"""Key, in the text of a free body in scene.xml, of the body that it lies in."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Touch:
    """Two bodies that overlap."""

    bodies: tuple[int, int]
    depth_m: float
    names: str

    def between(self, some: set[int], others: set[int]) -> bool:
        """Whether one body is of the first set and the other of the second."""
        a, b = self.bodies
        return (a in some and b in others) or (b in some and a in others)


def touches(model: Any, positions: Mapping[str, float], scratch: Any | None = None) -> list[Touch]:
    """Overlapping body pairs, deepest first, with the named joints at the given positions and all others at zero.

    `scratch` is an MjData of the model to reuse: creating one takes 20 times as long as finding contacts.
    """
    import mujoco

    data = mujoco.MjData(model) if scratch is None else scratch
    mujoco.mj_resetData(model, data)
    for name, position in positions.items():
        data.qpos[model.joint(name).qposadr[0]] = position
    return overlapping(model, data)


def overlapping(model: Any, data: Any) -> list[Touch]:
    """Overlapping body pairs in the state of `data`, deepest first."""
    find_contacts(model, data)
    deepest: dict[tuple[int, int], float] = {}
    for contact in data.contact[: data.ncon]:
        pair = sorted(int(model.geom_bodyid[g]) for g in contact.geom)
        key = (pair[0], pair[1])
        deepest[key] = max(deepest.get(key, 0.0), -float(contact.dist))
    found = [Touch(bodies=k, depth_m=d, names=" and ".join(body_name(model, b) for b in k[::-1])) for k, d in deepest.items()]
    return sorted((touch for touch in found if touch.depth_m > 0), key=lambda touch: (-touch.depth_m, touch.bodies))


def joint_names(model: Any) -> list[str]:
    """Names of hinges and slides with a non-empty range."""
    names = [model.joint(j).name for j in range(model.njnt) if model.jnt_type[j] in (2, 3)]
    return [name for name in names if float(model.joint(name).range[1]) > float(model.joint(name).range[0])]


def movers_of(model: Any, joint: str) -> set[int]:
    """The bodies a joint moves."""
    found = {int(model.joint(joint).bodyid[0])}
    for body in range(min(found) + 1, model.nbody):  # parents come before children
        if int(model.body_parentid[body]) in found:
            found.add(body)
    return found


def free_bodies(model: Any) -> set[int]:
    """Bodies of free-standing objects."""
    roots = {int(model.jnt_bodyid[j]) for j in range(model.njnt) if model.jnt_type[j] == 0}
    return {body for body in range(model.nbody) if int(model.body_rootid[body]) in roots}


def carried_by(model: Any, carriers: set[int]) -> set[int]:
    """Free bodies that lie in one of these bodies, as scene.xml says."""
    ends = tuple(f"{CARRIED_BY}={model.body(carrier).name}" for carrier in carriers)
    return {body for body in free_bodies(model) if _text(model, model.body(body).name).endswith(ends)}


def _text(model: Any, name: str) -> str:
    """The custom text of that name; empty without one."""
    import mujoco

    number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TEXT, name)
    start, size = (0, 0) if number < 0 else (int(model.text_adr[number]), int(model.text_size[number]))
    return str(model.text_data[start : start + size].rstrip(b"\0").decode())


def body_name(model: Any, body: int) -> str:
    """The body's name; the world is called floor."""
    return "floor" if body == 0 else str(model.body(body).name)
