"""Random construction of a kitchen's fronts in a style.

Nothing here, nor in units.py, comes from the tables that the pipeline estimates with: handles, gaps, travels and depths have
distributions of their own, so that an estimate is never compared with the rule that drew it.
"""

from dataclasses import dataclass

import numpy as np

from r2c2r_core.synthetic.kitchen import Filling, Frame, HandleKind

LEVEL_HANDLE_SHARE = 0.12
"""Fraction of kitchens whose handles lie in the middle of the doors' upper or lower edge, uninformative for the hinge."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FaceFrame:
    """Widths of a face frame's members around a unit's openings."""

    stile_m: float
    rail_m: float
    between_m: float  # between two drawers


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """Construction of all fronts of one kitchen."""

    door_handle: HandleKind | None
    drawer_handle: HandleKind | None
    handle_length_m: float
    level_handles: bool
    rail_m: float | None  # of the frame of a front; None: slabs
    recess_m: float
    filling: Filling  # of wall cabinets' frames
    least_framed_m: float  # lower drawers are slabs
    face_frame: FaceFrame | None
    channel_m: float | None  # height of the channel over a front
    every_channel: bool  # else only over the lowest drawer: the ones above are pulled from below
    grip_m: float  # overhang of wall fronts below their carcass, to be pulled there

    def frame(self, height_m: float, *, upper: bool) -> Frame | None:
        """Frame of a front of that height; None for a slab."""
        glazed = upper and self.filling != "panel"
        if self.rail_m is None or (height_m < self.least_framed_m and not glazed):
            return None
        rail = min(self.rail_m, 0.25 * height_m)
        return Frame(rail_m=rail, recess_m=self.recess_m, filling=self.filling if upper else "panel")


@dataclass(frozen=True, slots=True, kw_only=True)
class _Make:
    """Probabilities and options of a style."""

    framed: float = 0.0  # share of the kitchens with framed fronts
    doors: tuple[HandleKind, ...] = ()
    drawers: tuple[HandleKind, ...] | None = None  # None: as the doors'
    inset: bool = False
    channels: bool = False
    glazed: bool = False


_PULLS: tuple[HandleKind, ...] = ("bar", "bar", "bow", "flat")
_MAKES = {
    "slab": _Make(doors=_PULLS),
    "shaker": _Make(framed=1.0, doors=("bar", "bow", "knob")),
    "framed": _Make(framed=0.6, doors=("knob",), inset=True),
    "handleless": _Make(channels=True),
    "push": _Make(),
    "glass": _Make(framed=1.0, doors=("bar", "bow", "knob"), glazed=True),
    "cup": _Make(framed=0.5, doors=("knob",), drawers=("cup",)),
    "knobs": _Make(framed=0.5, doors=("knob",)),
}


def pick_look(style: str, rng: np.random.Generator) -> Look:
    """Random look of one kitchen in a style of choices.py."""
    make = _MAKES[style]
    door = _one_of(make.doors, rng)
    drawer = door if make.drawers is None else _one_of(make.drawers, rng)
    framed = bool(rng.random() < make.framed)
    frosted = bool(rng.random() < 0.3)
    return Look(
        door_handle=door,
        drawer_handle=drawer,
        handle_length_m=float(np.exp(rng.uniform(np.log(0.11), np.log(0.34)))),
        level_handles=bool(rng.random() < LEVEL_HANDLE_SHARE) and door in ("bar", "flat", "bow"),
        rail_m=float(rng.uniform(0.045, 0.085)) if framed else None,
        recess_m=float(rng.uniform(0.005, 0.011)),
        filling=("frosted" if frosted else "glass") if make.glazed else "panel",
        least_framed_m=float(rng.choice((0.14, 0.24))),
        face_frame=_pick_face_frame(rng) if make.inset else None,
        channel_m=float(rng.uniform(0.022, 0.034)) if make.channels else None,
        every_channel=bool(rng.random() < 0.6),
        grip_m=float(rng.uniform(0.015, 0.025)) if make.channels else 0.0,
    )


def _pick_face_frame(rng: np.random.Generator) -> FaceFrame:
    return FaceFrame(
        stile_m=float(rng.uniform(0.019, 0.040)),
        rail_m=float(rng.uniform(0.022, 0.042)),
        between_m=float(rng.uniform(0.018, 0.034)),
    )


def _one_of(kinds: tuple[HandleKind, ...], rng: np.random.Generator) -> HandleKind | None:
    return kinds[int(rng.integers(len(kinds)))] if kinds else None
