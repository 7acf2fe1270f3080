"""A cap that the masks miss, and a shadow that the masks include."""

from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.generate.evidence import gather_evidence
from r2c2r_core.generate.symmetry import Revolution
from r2c2r_core.generate.unmasked import with_unmasked_top, without_flared_foot
from r2c2r_core.geometry.transforms import Rigid3

BODY = Revolution(np.zeros(2), np.array([0.9, 1.09, 1.13, 1.15]), np.array([0.04, 0.04, 0.015, 0.015]))  # up to the cap's base


def test_a_cap_missing_from_the_masks_is_found_in_depth(bottle_scene):
    """The bottle ends at 1.18 m, the masks and thus the profile at 1.15 m."""
    evidence = gather_evidence(*bottle_scene, 10)
    found = with_unmasked_top(BODY, evidence.pool, Rigid3())
    assert found.heights_m[-1] == pytest.approx(1.18, abs=0.005)
    assert found.radii_m[-1] == pytest.approx(0.015, abs=0.005)
    assert found.heights_m[:4] == pytest.approx(BODY.heights_m)


def test_a_complete_profile_is_not_extended_where_the_wall_shows_above(bottle_scene):
    evidence = gather_evidence(*bottle_scene, 10)
    whole = Revolution(np.zeros(2), np.array([0.9, 1.09, 1.13, 1.18]), BODY.radii_m)
    assert with_unmasked_top(whole, evidence.pool, Rigid3()) is whole


def test_a_profile_is_not_extended_when_depth_above_never_ends(bottle_scene):
    """Depth at the distance of the axis all the way up belongs to another object."""
    evidence = gather_evidence(*bottle_scene, 10)
    above = np.array([[0.0, 0.0, 1.16]])
    near = []
    for view in evidence.pool:
        depth = view.world_from_camera.inverse.apply(above)[0, 2]
        near.append(replace(view, depth_m=np.full_like(view.depth_m, depth)))
    assert with_unmasked_top(BODY, near, Rigid3()) is BODY


def test_a_shadow_at_the_base_is_removed_and_a_real_flare_is_kept():
    heights = np.linspace(0.0, 0.3, 41)
    flared = Revolution(np.zeros(2), heights, np.where(heights < 0.02, 0.06, 0.04))
    angle = np.linspace(-np.pi, 0.0, 60)
    body, foot = (r * np.column_stack([np.cos(angle), np.sin(angle)]) for r in (0.04, 0.06))
    shown = np.column_stack([body, np.full(60, 0.015)])
    assert without_flared_foot(flared, shown).radii_m == pytest.approx(np.full(41, 0.04))
    shown = np.column_stack([foot, np.full(60, 0.015)])
    assert without_flared_foot(flared, shown) is flared
