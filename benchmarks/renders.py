"""MuJoCo renderings of a bundle for visual inspection: closed, ajar, open, and each joint open alone.

    MUJOCO_GL=egl python benchmarks/renders.py BUNDLE.zip OUT.png [--size 960x540]

Needs OpenGL: EGL (libegl1, works without a GPU through Mesa), OSMesa, or a display. The camera is the bundle's own, `front`.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from r2c2r_core.export.archive import opened_bundle
from r2c2r_core.export.writers.stand import CAMERA

_COLUMNS = 3


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw and write one sheet."""
    parser = argparse.ArgumentParser(description="A bundle as MuJoCo draws it.")
    parser.add_argument("bundle", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--size", default="960x540")
    options = parser.parse_args(arguments)
    width, height = (int(word) for word in options.size.split("x"))
    with opened_bundle(options.bundle) as folder:
        cv2.imwrite(str(options.out), sheet(folder / "scene.xml", width, height)[..., ::-1])
    return 0


def sheet(mjcf: Path, width: int, height: int) -> np.ndarray:
    """All pictures of a scene.xml as one, captioned."""
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(mjcf))
    data = mujoco.MjData(model)
    pictures = []
    with mujoco.Renderer(model, height, width) as renderer:
        for number in range(model.nkey):
            mujoco.mj_resetDataKeyframe(model, data, number)
            mujoco.mj_forward(model, data)
            renderer.update_scene(data, camera=CAMERA, scene_option=_visuals_only())
            picture = renderer.render().copy()
            cv2.putText(picture, model.key(number).name, (16, 34), cv2.FONT_HERSHEY_SIMPLEX, 0.8, (60, 64, 72), 2, cv2.LINE_AA)
            pictures.append(picture)
    pictures += [np.full_like(pictures[0], 255)] * (-len(pictures) % _COLUMNS)
    rows = [np.hstack(pictures[k : k + _COLUMNS]) for k in range(0, len(pictures), _COLUMNS)]
    return np.vstack(rows)


def _visuals_only() -> "object":
    import mujoco

    option = mujoco.MjvOption()
    option.geomgroup[3] = 0  # colliders
    return option


if __name__ == "__main__":
    sys.exit(main())
