"""Hollow mugs, with the handle where the outlines show it."""

import numpy as np
import pytest

from r2c2r_core.generate.evidence import gather_evidence
from r2c2r_core.generate.symmetry import Revolution
from r2c2r_core.generate.vessel import VesselHandle, vessel_mesh
from r2c2r_core.geometry.hollows import find_hollow
from r2c2r_core.geometry.meshes import is_manifold, is_watertight, volume
from r2c2r_core.kitchen.names import category_of
from tests.core.generate.scenes import best_thing, mug_scene


@pytest.mark.parametrize("azimuth", [0.4, 3.6])
def test_a_mug_is_hollow_with_its_handle_at_the_observed_azimuth(azimuth):
    evidence = gather_evidence(*mug_scene(azimuth), 10)
    shape = best_thing(evidence)
    assert (shape.parameters["hollow"], shape.parameters["handles"]) == (1.0, 1.0)
    world = shape.vertices_world
    assert np.ptp(world[:, 2]) == pytest.approx(0.09, abs=0.004)
    out = np.array([np.cos(azimuth), np.sin(azimuth)])
    assert (world[:, :2] @ out).max() == pytest.approx(0.068, abs=0.012)
    assert (world[:, :2] @ -out).max() == pytest.approx(0.04, abs=0.005)
    assert find_hollow(world, shape.faces) is not None


def test_a_cup_without_a_handle_gets_no_handle():
    evidence = gather_evidence(*mug_scene(None), 10)
    shape = best_thing(evidence)
    assert (shape.parameters["hollow"], shape.parameters["handles"]) == (1.0, 0.0)


@pytest.mark.parametrize("handle", [None, VesselHandle(1.0, 0.03)])
def test_vessels_are_closed_manifold_and_outward(handle):
    body = Revolution(np.array([0.1, 0.0]), np.linspace(0.0, 0.09, 20), np.linspace(0.03, 0.04, 20))
    vertices, faces = vessel_mesh(body, handle)
    assert is_watertight(vertices, faces)
    assert is_manifold(vertices, faces)
    solid = np.pi * 0.035**2 * 0.09
    assert 0.1 * solid < volume(vertices, faces) < 0.4 * solid


def test_names_of_open_vessels_are_recognised():
    assert all(category_of(name).open_vessel for name in ("mug", "coffee_mug", "bowls", "plant pot"))
    assert not any(category_of(name).open_vessel for name in ("bottle", "cupboard", "teapot", "panel", "potato", "jar"))


@pytest.mark.parametrize("azimuth", [0.0, 2.0])
def test_the_handle_of_a_tall_jug_protrudes_only_on_its_side(azimuth):
    jug = Revolution(np.zeros(2), np.array([0.0, 0.15, 0.3]), np.full(3, 0.05))
    vertices, faces = vessel_mesh(jug, VesselHandle(azimuth, 0.05))
    out = np.array([np.cos(azimuth), np.sin(azimuth)])
    assert (vertices[:, :2] @ -out).max() == pytest.approx(0.05, abs=0.001)
    assert (vertices[:, :2] @ out).max() == pytest.approx(0.10, abs=0.001)
    assert is_watertight(vertices, faces)


@pytest.mark.parametrize("height", [0.008, 0.02, 0.03])
def test_a_flat_pan_keeps_its_handle(height):
    pan = Revolution(np.zeros(2), np.array([0.0, height]), np.full(2, 0.1))
    vertices, faces = vessel_mesh(pan, VesselHandle(0.0, 0.05))
    assert vertices[:, 0].max() == pytest.approx(0.15, abs=0.001)
    assert is_watertight(vertices, faces)
    assert is_manifold(vertices, faces)
