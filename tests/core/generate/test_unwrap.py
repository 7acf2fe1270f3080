"""Charts of xatlas."""

import os

import numpy as np
import trimesh

from r2c2r_core.generate.unwrap import unwrap

BLOCKING = """
import pathlib
import numpy as np

class Atlas:
    def add_mesh(self, vertices, faces):
        self.vertices, self.faces = vertices, faces

    def generate(self):
        pass

    def __getitem__(self, number):
        return np.arange(len(self.vertices), dtype=np.uint32), self.faces, self.vertices[:, :2]

    def __del__(self):
        pathlib.Path(__file__).with_name("freed").touch()
"""


def test_every_face_of_a_sphere_is_in_a_chart():
    sphere = trimesh.creation.icosphere(2)
    source, faces, uv = unwrap(sphere.vertices, sphere.faces)
    assert np.array_equal(np.sort(source[faces], axis=1), np.sort(sphere.faces, axis=1))
    assert uv.shape == (len(source), 2)
    assert uv.min() >= 0.0
    assert uv.max() <= 1.0


def test_the_atlas_is_never_freed_as_its_destructor_can_block(tmp_path, monkeypatch):
    (tmp_path / "xatlas.py").write_text(BLOCKING)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    box = trimesh.creation.box()
    source, faces, _ = unwrap(box.vertices, box.faces)
    assert np.array_equal(source[faces], box.faces)
    assert not (tmp_path / "freed").exists()
