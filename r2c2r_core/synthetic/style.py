"""Paints common to all units of a kitchen: fronts, worktop, tiles, floor, metal."""

import numpy as np

from r2c2r_core.synthetic.kitchen import Paint, Style


def pick_style(rng: np.random.Generator) -> tuple[Style, bool]:
    """Random paints and dimensions of a kitchen, and whether its fronts are framed."""
    fronts: list[Paint] = [
        Paint(kind="laminate", colour=(0.82, 0.81, 0.78), gloss=0.25),
        Paint(kind="laminate", colour=(0.76, 0.72, 0.62), gloss=0.15),
        Paint(kind="wood", colour=(0.46, 0.27, 0.13), accent=(0.30, 0.16, 0.07), gloss=0.15),
        Paint(kind="wood", colour=(0.60, 0.43, 0.26), accent=(0.46, 0.31, 0.17), gloss=0.12),
        Paint(kind="laminate", colour=(0.33, 0.37, 0.38), gloss=0.2),
        Paint(kind="laminate", colour=(0.10, 0.22, 0.26), gloss=0.2),
        Paint(kind="laminate", colour=(0.36, 0.44, 0.34), gloss=0.15),
    ]
    base = fronts[int(rng.integers(len(fronts)))]
    upper = base if rng.random() < 0.6 else fronts[int(rng.integers(2))]
    worktop = [
        Paint(kind="granite", colour=(0.10, 0.10, 0.11), accent=(0.35, 0.34, 0.33), gloss=0.5, texel_m=0.002),
        Paint(kind="granite", colour=(0.62, 0.60, 0.57), accent=(0.35, 0.33, 0.30), gloss=0.3, texel_m=0.002),
        Paint(kind="wood", colour=(0.52, 0.33, 0.17), accent=(0.34, 0.19, 0.08), gloss=0.2, texel_m=0.002),
    ][int(rng.integers(3))]
    splash = [
        Paint(kind="tiles", colour=(0.80, 0.81, 0.80), accent=(0.55, 0.54, 0.52), gloss=0.4, texel_m=0.002, seed=20),
        Paint(kind="tiles", colour=(0.42, 0.55, 0.58), accent=(0.70, 0.70, 0.68), gloss=0.4, texel_m=0.002, seed=10),
        Paint(kind="plaster", colour=(0.72, 0.70, 0.66), texel_m=0.004),
    ][int(rng.integers(3))]
    floor = [
        Paint(kind="planks", colour=(0.42, 0.27, 0.15), accent=(0.24, 0.14, 0.07), gloss=0.2, texel_m=0.003),
        Paint(kind="tiles", colour=(0.50, 0.48, 0.45), accent=(0.30, 0.29, 0.28), gloss=0.25, texel_m=0.003, seed=40),
        Paint(kind="planks", colour=(0.55, 0.47, 0.38), accent=(0.38, 0.31, 0.24), gloss=0.2, texel_m=0.003),
    ][int(rng.integers(3))]
    wall = Paint(
        kind="plaster", colour=rgb(rng.choice([(0.78, 0.77, 0.74), (0.75, 0.70, 0.58), (0.60, 0.66, 0.68)])), texel_m=0.005
    )
    metal = [
        Paint(kind="steel", colour=(0.55, 0.55, 0.55), gloss=0.8, texel_m=0.002),
        Paint(kind="laminate", colour=(0.02, 0.02, 0.022), gloss=0.3, texel_m=0.002),
        Paint(kind="steel", colour=(0.58, 0.42, 0.18), gloss=0.8, texel_m=0.002),
    ][int(rng.integers(3))]
    shaker = bool(rng.random() < 0.3)
    style = Style(
        base_front=base,
        wall_front=upper,
        carcass=Paint(kind="laminate", colour=(0.70, 0.69, 0.66), texel_m=0.004),
        plinth=Paint(kind="laminate", colour=rgb(np.array(base.colour) * 0.6), texel_m=0.003),
        worktop=worktop,
        splash=splash,
        wall=wall,
        floor=floor,
        handle=metal,
        gap_m=float(rng.uniform(0.002, 0.004)),
        front_thickness_m=float(rng.uniform(0.018, 0.021)),
        daylight=float(rng.uniform(0.3, 0.7)),
    )
    return style, shaker


def rgb(values: object) -> tuple[float, float, float]:
    """Three numbers as a colour tuple."""
    r, g, b = (float(v) for v in np.asarray(values, dtype=float))
    return (r, g, b)
