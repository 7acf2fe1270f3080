"""How the fronts of a kitchen are made: profile, handles, gaps, paint and grain."""

from dataclasses import dataclass

import numpy as np

from training.canvas import Elevation, any_paint, clip, noise


@dataclass(frozen=True)
class FaceFrame:
    """What fronts are inset in: rails and stiles of the carcass, of their own widths; none of it is a front."""

    top_m: float
    bottom_m: float
    between_m: float  # rails between the fronts of a unit
    stile_m: float  # at each side of a unit
    mullion_m: float  # between the doors of a pair; 0: none
    light: np.ndarray  # of the fronts' paint: mostly the same
    behind_m: float  # fronts may overlay it
    joint_light: float  # of the hairline where two units' frames meet; 1: none


@dataclass(frozen=True)
class Style:
    """How the fronts of one kitchen are made."""

    kind: str  # slab, shaker, raised, bead, louver, glass
    handle: str  # bar, knob, cup, edge, channel, none
    gap_m: float
    gap_light: float  # of the front's light that a gap shows: edges of dark fronts may be lighter
    gap_shown: float  # share of a gap's length that shows: thin ones come out dashed
    frame: FaceFrame | None
    stile_m: float
    recess_light: float
    line_light: float
    paint: np.ndarray
    grain: float
    grain_level: bool
    uneven: float  # brightness between fronts
    handle_colour: np.ndarray
    handle_share: float  # of a front's side
    handle_m: float
    handle_thick_m: float
    handle_off_m: float
    gloss: float


def any_style(rng: np.random.Generator) -> Style:
    kind = str(rng.choice(["slab", "shaker", "raised", "bead", "louver", "glass"], p=[0.46, 0.26, 0.12, 0.06, 0.03, 0.07]))
    handle = str(rng.choice(["bar", "knob", "cup", "edge", "channel", "none"], p=[0.52, 0.17, 0.06, 0.08, 0.09, 0.08]))
    paint = any_paint(rng)
    metal = rng.uniform(0.25, 0.9)
    handle_colour = (
        np.full(3, metal) if rng.random() < 0.6 else rng.uniform(0.01, 0.2, 3) if rng.random() < 0.6 else any_paint(rng)
    )
    long_bar = rng.random() < 0.3
    return Style(
        kind=kind,
        handle=handle,
        gap_m=float(rng.choice([rng.uniform(0.001, 0.004), rng.uniform(0.003, 0.008)], p=[0.8, 0.2])),
        gap_light=_gap_light(rng),
        gap_shown=float(rng.uniform(0.3, 0.8)) if rng.random() < 0.25 else 1.0,
        frame=_face_frame(rng) if rng.random() < 0.33 else None,
        stile_m=rng.uniform(0.035, 0.11),
        recess_light=rng.uniform(0.82, 1.08),
        line_light=float(rng.uniform(0.25, 0.95)),
        paint=paint,
        grain=float(rng.choice([0.0, rng.uniform(0.05, 0.5)], p=[0.62, 0.38])),
        grain_level=bool(rng.random() < 0.25),
        uneven=float(rng.choice([0.004, 0.05], p=[0.6, 0.4])),
        handle_colour=handle_colour,
        handle_share=rng.uniform(0.5, 0.95) if long_bar else 0.0,
        handle_m=rng.uniform(0.07, 0.35),
        handle_thick_m=rng.uniform(0.006, 0.022),
        handle_off_m=rng.uniform(0.02, 0.11),
        gloss=float(rng.choice([0.0, rng.uniform(0.05, 0.5)], p=[0.55, 0.45])),
    )


def _gap_light(rng: np.random.Generator) -> float:
    return float(rng.choice([rng.uniform(0.03, 0.4), rng.uniform(0.4, 0.93), rng.uniform(1.08, 2.2)], p=[0.58, 0.32, 0.1]))


def _face_frame(rng: np.random.Generator) -> FaceFrame:
    stile = rng.uniform(0.008, 0.055)
    return FaceFrame(
        top_m=rng.uniform(0.0, 0.09) if rng.random() < 0.7 else stile,
        bottom_m=rng.uniform(0.0, 0.09) if rng.random() < 0.7 else stile,
        between_m=rng.uniform(0.008, 0.06),
        stile_m=stile,
        mullion_m=rng.uniform(0.015, 0.06) if rng.random() < 0.2 else 0.0,
        light=np.ones(3) if rng.random() < 0.85 else rng.uniform(0.4, 1.4, 3),
        behind_m=rng.uniform(0.015, 0.022) if rng.random() < 0.12 else 0.0,
        joint_light=rng.uniform(0.5, 0.97) if rng.random() < 0.3 else 1.0,
    )


def board(e: Elevation, box: tuple[float, float, float, float], paint: np.ndarray, style: Style) -> None:
    """Painted with soft borders, so that a gap may be narrower than a cell."""
    left, top, right, bottom = box
    at = clip(e, (int(np.floor(left)), int(np.floor(top)), int(np.ceil(right)), int(np.ceil(bottom))))
    rows, columns = np.arange(at[0].start, at[0].stop), np.arange(at[1].start, at[1].stop)
    if not len(rows) or not len(columns):
        return
    cover_x = np.clip(np.minimum(columns + 1, right) - np.maximum(columns, left), 0, 1)
    cover_y = np.clip(np.minimum(rows + 1, bottom) - np.maximum(rows, top), 0, 1)
    cover = (cover_y[:, None] * cover_x)[..., None].astype(np.float32)
    under = e.colour[at].copy()
    e.colour[at] = paint
    grained(e, at, style)
    if style.gloss and e.rng.random() < 0.7:
        shape = e.front[at].shape
        glare = np.clip(2.5 * noise(e.rng, shape, e.rng.uniform(30, 200), (1, e.rng.uniform(0.5, 4))) - 1.2, 0, 1)
        e.colour[at] += style.gloss * glare[..., None] * e.rng.uniform(0.2, 0.8)
    e.colour[at] = under + cover * (e.colour[at] - under)


def grained(e: Elevation, at: tuple[slice, slice], style: Style, *, turned: bool = False) -> None:
    """Grain along the style's direction, or across it."""
    shape = e.front[at].shape
    if not style.grain or not all(shape):
        return
    stretch = (12.0, 0.4) if style.grain_level != turned else (0.4, 12.0)
    scale = e.rng.uniform(2, 12)
    grain = noise(e.rng, shape, scale, stretch) + 0.6 * noise(e.rng, shape, 3 * scale, stretch) - 0.8
    e.colour[at] *= np.clip(1 + style.grain * grain, 0.2, 1.8)[..., None]
