"""Procedural albedo textures: one painter per material, no asset files. All return linear RGB float32 (h, w, 3)."""

from collections.abc import Callable

import cv2
import numpy as np

from r2c2r_core.synthetic.kitchen import Paint

Painter = Callable[[int, int, Paint, np.random.Generator], np.ndarray]


def paint_tile(height_px: int, width_px: int, paint: Paint, rng: np.random.Generator) -> np.ndarray:
    """The albedo of one surface, row 0 at its top."""
    return np.clip(PAINTERS[paint.kind](height_px, width_px, paint, rng), 0.0, 1.0).astype(np.float32)


def value_noise(rng: np.random.Generator, height: int, width: int, cell: tuple[float, float]) -> np.ndarray:
    """Smooth noise of unit variance at the nodes; `cell` is its (vertical, horizontal) period in pixels."""
    step_y, step_x = max(round(cell[0]), 1), max(round(cell[1]), 1)
    rows, columns = height // step_y + 4, width // step_x + 4
    nodes = rng.standard_normal((rows, columns)).astype(np.float32)
    grown = cv2.resize(nodes, (columns * step_x, rows * step_y), interpolation=cv2.INTER_CUBIC)
    return np.asarray(grown[step_y : step_y + height, step_x : step_x + width])


def _flat(height: int, width: int, colour: tuple[float, float, float]) -> np.ndarray:
    return np.broadcast_to(np.array(colour, np.float32), (height, width, 3)).copy()


def _laminate(height: int, width: int, paint: Paint, rng: np.random.Generator) -> np.ndarray:
    image = _flat(height, width, paint.colour)
    fine = value_noise(rng, height, width, (2, 2))
    cloud = value_noise(rng, height, width, (0.12 / paint.texel_m, 0.12 / paint.texel_m))
    return image * (1 + 0.012 * fine + 0.012 * cloud)[..., None]


def _wood(height: int, width: int, paint: Paint, rng: np.random.Generator) -> np.ndarray:
    """Grain along the longer side of a panel, darker rings bent by slow noise."""
    if width > height * 1.6:
        return np.ascontiguousarray(_wood(width, height, paint, rng).transpose(1, 0, 2))
    px = 1 / paint.texel_m
    across = np.linspace(0, width * paint.texel_m, width, dtype=np.float32)[None, :]
    slow = value_noise(rng, height, width, (0.9 * px, 0.16 * px))
    bend = 0.012 * slow + 0.0025 * value_noise(rng, height, width, (0.18 * px, 0.04 * px))
    period = float(rng.uniform(0.016, 0.028))
    rings = 0.5 + 0.5 * np.sin((across + bend + float(rng.uniform(0, 1))) * 2 * np.pi / period)
    fibre = value_noise(rng, height, width, (0.05 * px, px * 0.0018)) + value_noise(rng, height, width, (0.25 * px, 0.005 * px))
    pores = value_noise(rng, height, width, (0.012 * px, px * 0.0018)) > 1.9
    share = np.clip(0.30 * rings**2 + 0.12 * fibre + 0.10 * slow + 0.22, 0, 1)
    share = np.where(pores, np.minimum(share + 0.35, 1), share)[..., None]
    plank = 1 + 0.05 * float(rng.standard_normal())
    return (np.array(paint.colour, np.float32) * (1 - share) + np.array(paint.accent, np.float32) * share) * plank


def _steel(height: int, width: int, paint: Paint, rng: np.random.Generator) -> np.ndarray:
    streak = value_noise(rng, height, width, (1, 60)) * 0.03 + value_noise(rng, height, width, (150, 400)) * 0.03
    return _flat(height, width, paint.colour) * (1 + streak)[..., None]


def _granite(height: int, width: int, paint: Paint, rng: np.random.Generator) -> np.ndarray:
    px = 1 / paint.texel_m
    speckle = value_noise(rng, height, width, (0.004 * px, 0.004 * px)) + 0.7 * value_noise(
        rng, height, width, (0.012 * px, 0.012 * px)
    )
    share = np.clip((speckle - 0.5) * 0.9, 0, 1)[..., None]
    cloud = 1 + 0.06 * value_noise(rng, height, width, (0.2 * px, 0.2 * px))[..., None]
    return (np.array(paint.colour, np.float32) * (1 - share) + np.array(paint.accent, np.float32) * share) * cloud


def _tiles(height: int, width: int, paint: Paint, rng: np.random.Generator) -> np.ndarray:
    """Tiles with grout; `paint.seed` is the tile's width in centimetres (20: metro bond, else square)."""
    size = paint.seed / 100 / paint.texel_m
    tall = size / 2 if paint.seed == 20 else size
    row = (np.arange(height) / tall).astype(int)
    shift = 0.5 * (row % 2) if paint.seed == 20 else np.zeros(height)
    u = np.arange(width)[None, :] / size + shift[:, None]
    column = u.astype(int)
    tone = rng.standard_normal((row.max() + 1, column.max() + 1)).astype(np.float32)[row[:, None], column]
    grout = 0.002 / paint.texel_m
    joint = ((u - column) * size < grout) | ((np.arange(height) - row * tall) < grout)[:, None]
    image = (
        _flat(height, width, paint.colour) * (1 + 0.035 * tone + 0.02 * value_noise(rng, height, width, (30, 30)))[..., None]
    )
    image[joint] = paint.accent
    return image


def _planks(height: int, width: int, paint: Paint, rng: np.random.Generator) -> np.ndarray:
    """Floor boards 0.14 m wide and about 1.2 m long, along the image's x."""
    board = max(round(0.14 / paint.texel_m), 2)
    image = np.zeros((height, width, 3), np.float32)
    length = round(1.2 / paint.texel_m)
    for top in range(0, height, board):
        start = -int(rng.integers(length))
        while start < width:
            left, right, bottom = max(start, 0), min(start + length, width), min(top + board, height)
            if right > left:
                piece = _wood(right - left, bottom - top, paint, rng).transpose(1, 0, 2)
                image[top:bottom, left:right] = piece * (1 + 0.1 * float(rng.standard_normal()))
                image[top:bottom, left : left + 1] *= 0.5
            start += length
        image[top : top + 1] *= 0.5
    return image


def _plaster(height: int, width: int, paint: Paint, rng: np.random.Generator) -> np.ndarray:
    px = 1 / paint.texel_m
    tone = 0.02 * value_noise(rng, height, width, (0.5 * px, 0.5 * px)) + 0.012 * value_noise(rng, height, width, (3, 3))
    return _flat(height, width, paint.colour) * (1 + tone)[..., None]


def _label(height: int, width: int, paint: Paint, rng: np.random.Generator) -> np.ndarray:
    """A paper label that goes round the bottle: a band, a title and lines of small print, repeated on the back."""
    image = _flat(height, width, paint.colour)
    own = np.random.default_rng(paint.seed)
    accent = np.array(paint.accent, np.float32)
    image[: height // 8] = accent
    image[-height // 10 :] = accent * 0.7
    for side in (0, width // 2):
        span = width // 2
        cv2.circle(image, (side + span // 2, height // 3), max(height // 9, 2), [float(c) for c in accent], -1)
        for line in range(height // 2, height - height // 8, max(height // 14, 3)):
            x = side + span // 6
            while x < side + span * 5 // 6:
                word = int(own.integers(3, 12))
                image[line : line + max(height // 40, 1), x : x + word] = accent * 0.5
                x += word + 3
    return image


def _microwave_door(height: int, width: int, paint: Paint, rng: np.random.Generator) -> np.ndarray:
    """A dark window with a perforated screen, in a frame."""
    image = _laminate(height, width, paint, rng)
    y, x = max(round(0.035 / paint.texel_m), 1), max(round(0.045 / paint.texel_m), 1)
    if height <= 2 * y or width <= 2 * x:
        return image
    dots = ((np.arange(height)[:, None] // 2 + np.arange(width)[None, :] // 2) % 2) * 0.008
    image[y:-y, x:-x] = (0.012 + dots[y:-y, x:-x])[..., None]
    return image


def _controls(height: int, width: int, paint: Paint, rng: np.random.Generator) -> np.ndarray:
    """A control panel: a display above a grid of buttons."""
    image = _flat(height, width, paint.colour)
    top, margin = height // 8, width // 6
    image[top : top + height // 8, margin:-margin] = (0.01, 0.02, 0.02)
    for digit in range(4):
        x = margin + (digit + 1) * (width - 2 * margin) // 6
        image[top + height // 40 : top + height // 10, x : x + max(width // 16, 1)] = (0.1, 0.65, 0.55)
    for row in range(5):
        for column in range(3):
            y = height * 3 // 10 + row * height // 8
            x = margin + column * (width - 2 * margin) // 3
            cv2.rectangle(image, (x + 2, y), (x + (width - 2 * margin) // 3 - 3, y + height // 12), list(paint.accent), -1)
    return image


def _oven_front(height: int, width: int, paint: Paint, rng: np.random.Generator) -> np.ndarray:
    """A strip of two knobs and a display over a door of dark glass."""
    image = _flat(height, width, paint.colour)
    strip, edge = round(0.17 * height), max(height // 200, 1)
    image[strip - edge : strip + edge] = 0.0
    for share in (0.16, 0.84):
        cv2.circle(image, (round(share * width), strip // 2), strip // 4, list(paint.accent), -1, cv2.LINE_AA)
    image[strip // 3 : 2 * strip // 3, width * 2 // 5 : width * 3 // 5] = (0.01, 0.02, 0.02)
    y, x = strip + height // 7, width // 8
    image[y : height - height // 10, x:-x] = 0.008
    return image


def _microwave_front(height: int, width: int, paint: Paint, rng: np.random.Generator) -> np.ndarray:
    """A built-in one: its door, and the controls to the right of it."""
    split = round(0.78 * width)
    image = _flat(height, width, paint.colour)
    image[:, :split] = _microwave_door(height, split, paint, rng)
    image[:, split : split + max(width // 200, 1)] = 0.0
    controls = Paint(kind="controls", colour=paint.colour, accent=paint.accent)
    image[:, split + max(width // 200, 1) :] = _controls(height, width - split - max(width // 200, 1), controls, rng)
    return image


def _stripes(height: int, width: int, paint: Paint, rng: np.random.Generator) -> np.ndarray:
    """Woven cloth with bands across its ends."""
    image = _flat(height, width, paint.colour) * (1 + 0.06 * value_noise(rng, height, width, (2, 2)))[..., None]
    for band in (0.06, 0.12, 0.82, 0.88, 0.94):
        image[round(band * height) : round((band + 0.03) * height)] = paint.accent
    return image


def _hob(height: int, width: int, paint: Paint, rng: np.random.Generator) -> np.ndarray:
    """Black glass with four printed rings and a row of touch fields."""
    image = _flat(height, width, paint.colour)
    for u, v, share in ((0.27, 0.28, 0.15), (0.73, 0.28, 0.12), (0.27, 0.7, 0.12), (0.73, 0.66, 0.17)):
        cv2.circle(
            image, (int(u * width), int(v * height)), int(share * width), list(paint.accent), max(width // 160, 1), cv2.LINE_AA
        )
    for i in range(7):
        cv2.circle(image, (int((0.32 + 0.06 * i) * width), int(0.94 * height)), max(width // 90, 1), list(paint.accent), -1)
    return image


def _spines(height: int, width: int, paint: Paint, rng: np.random.Generator) -> np.ndarray:
    """A row of book spines, each with a title."""
    image, x = _flat(height, width, (0.02, 0.02, 0.02)), 0
    while x < width:
        thick = max(int(rng.uniform(0.012, 0.045) / paint.texel_m), 3)
        colour = (rng.uniform(0.05, 0.5) * (0.55 + 0.45 * rng.uniform(0, 1, 3))).astype(np.float32)
        top = int(rng.uniform(0.0, 0.25) * height)
        image[top:, x : x + thick - 1] = colour
        ink = np.clip(colour + (0.5 if colour.mean() < 0.3 else -0.3), 0, 1)
        middle = x + thick // 2
        y = top + height // 8
        while y < height * 3 // 4:
            letter = int(rng.integers(2, 6))
            image[y : y + letter, middle - thick // 6 : middle + thick // 6 + 1] = ink
            y += letter + int(rng.integers(1, 4))
        x += thick
    return image


def _picture(height: int, width: int, paint: Paint, rng: np.random.Generator) -> np.ndarray:
    """A framed print of soft coloured shapes on a white mount."""
    image = _flat(height, width, (0.75, 0.75, 0.72))
    y, x = height // 6, width // 6
    inner = image[y:-y, x:-x]
    inner[:] = rng.uniform(0.2, 0.6, 3)
    for _ in range(9):
        centre = (int(rng.integers(inner.shape[1])), int(rng.integers(inner.shape[0])))
        cv2.circle(
            inner, centre, int(rng.uniform(0.05, 0.3) * width), [float(c) for c in rng.uniform(0.05, 0.7, 3)], -1, cv2.LINE_AA
        )
    frame = max(width // 25, 1)
    image[:frame] = image[-frame:] = paint.accent
    image[:, :frame] = image[:, -frame:] = paint.accent
    return image


def _plain(height: int, width: int, paint: Paint, rng: np.random.Generator) -> np.ndarray:
    return _flat(height, width, paint.colour)


PAINTERS: dict[str, Painter] = {
    "laminate": _laminate,
    "wood": _wood,
    "steel": _steel,
    "granite": _granite,
    "tiles": _tiles,
    "planks": _planks,
    "plaster": _plaster,
    "label": _label,
    "microwave_door": _microwave_door,
    "controls": _controls,
    "oven_front": _oven_front,
    "microwave_front": _microwave_front,
    "stripes": _stripes,
    "hob": _hob,
    "spines": _spines,
    "picture": _picture,
    "plain": _plain,
    "emitter": _plain,
    "glass": _plain,
}
