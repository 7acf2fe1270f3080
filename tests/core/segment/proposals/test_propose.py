from dataclasses import replace

import numpy as np
import pytest

from r2c2r_core.geometry.masks import mask_iou, unpack_mask
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import ObjectPrompt
from r2c2r_core.model.proposal import Proposal
from r2c2r_core.segment.fronts.found import FoundFront
from r2c2r_core.segment.geometric.session import GeometricSession
from r2c2r_core.segment.mosaics.handles import GridHandle
from r2c2r_core.segment.proposals import panels
from r2c2r_core.segment.proposals.naming import FrontLook, name_front, name_thing
from r2c2r_core.segment.proposals.propose import clashes, covered_share, is_taken
from tests.core.segment.conftest import Truth
from tests.core.segment.scenes import DOORS, DRAWERS

Boxes = tuple[Capture, Truth]


@pytest.fixture(scope="module")
def steps(session: GeometricSession) -> list[tuple[float, tuple[Proposal, ...]]]:
    return list(session.propose())


@pytest.fixture(scope="module")
def proposals(steps: list[tuple[float, tuple[Proposal, ...]]]) -> tuple[Proposal, ...]:
    return steps[-1][1]


def name_of(proposal: Proposal, truth: Truth) -> str | None:
    """The true object that it overlaps by at least half."""
    outline = unpack_mask(proposal.outline)
    names = [name for name, masks in truth.items() if mask_iou(outline, masks[proposal.click.frame]) > 0.5]
    return names[0] if names else None


def test_each_front_is_proposed_once_with_its_category(proposals: tuple[Proposal, ...], boxes: Boxes) -> None:
    fronts = [proposal for proposal in proposals if proposal.kind == "front"]
    named = {name_of(proposal, boxes[1]): proposal.category for proposal in fronts}
    assert named == dict.fromkeys(DOORS, "cabinet") | dict.fromkeys(DRAWERS, "drawer")
    assert len(fronts) == len(named)


@pytest.mark.parametrize("things", [1, pytest.param(None, marks=pytest.mark.slow, id="all")])
def test_the_proposed_click_reproduces_the_proposed_outline(
    proposals: tuple[Proposal, ...], session: GeometricSession, things: int | None
) -> None:
    found = [proposal for proposal in proposals if proposal.kind != "front"]
    assert len(found) > 1
    for proposal in [*(proposal for proposal in proposals if proposal.kind == "front"), *found[::-1][:things]]:
        prompt = ObjectPrompt(name="any", category=proposal.category, points=(proposal.click,))
        mask = session.mask_at(prompt, proposal.click.frame)
        np.testing.assert_array_equal(mask, unpack_mask(proposal.outline))
        assert mask[int(proposal.click.y), int(proposal.click.x)]


def test_proposed_clicks_avoid_the_handles_of_their_fronts(proposals: tuple[Proposal, ...]) -> None:
    for proposal in proposals:
        if proposal.kind != "front":
            continue
        u, v = np.array(proposal.handle_px).T
        assert not (u.min() <= proposal.click.x <= u.max() and v.min() <= proposal.click.y <= v.max())


def test_progress_and_proposals_increase_until_done(steps: list[tuple[float, tuple[Proposal, ...]]]) -> None:
    fractions = [fraction for fraction, _ in steps]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
    counts = [len(found) for _, found in steps]
    assert counts == sorted(counts)
    confidences = [proposal.confidence for proposal in steps[-1][1]]
    assert confidences == sorted(confidences, reverse=True)


def test_a_mask_covers_its_own_proposal_and_no_other(proposals: tuple[Proposal, ...], boxes: Boxes) -> None:
    for proposal in (proposal for proposal in proposals if proposal.kind == "front"):
        masks = {name: masks[proposal.click.frame] for name, masks in boxes[1].items()}
        own = name_of(proposal, boxes[1])
        for name, mask in masks.items():
            assert is_taken(covered_share(unpack_mask(proposal.outline), mask)) == (name == own)


def test_overlapping_proposals_are_flagged_and_neighbours_are_not(
    proposals: tuple[Proposal, ...], session: GeometricSession
) -> None:
    assert {proposal.doubts for proposal in proposals} == {()}
    drawer = next(proposal for proposal in proposals if proposal.category == "drawer")
    found = session.find(ObjectPrompt(name="any", category="drawer", points=(drawer.click,)))
    assert isinstance(found, FoundFront)
    cell, cell_m = found.front.cell, found.front.run.grid.cell_m
    panel = panels.Panel(found.front, "drawer", 0.9)

    def beside(overlap_m: float) -> panels.Panel:
        move = cell.width - overlap_m / cell_m
        shifted = replace(cell, left=cell.left + move, right=cell.right + move)
        return panels.Panel(replace(found.front, cell=shifted), "drawer", 0.8)

    assert clashes(beside(0.003), [(drawer, panel)]) == ()
    assert clashes(beside(0.03), [(drawer, panel)]) == ("overlaps the proposed drawer beside it by 3 cm",)


def bar(width: float, height: float) -> GridHandle:
    return GridHandle(left=0, top=0, right=width, bottom=height, confidence=0.9)


@pytest.mark.parametrize(
    ("look", "category"),
    [
        (FrontLook(width_m=0.5, height_m=0.15, bottom_m=0.7, handle=bar(80, 8)), "drawer"),
        (FrontLook(width_m=0.4, height_m=0.38, bottom_m=0.1, handle=bar(80, 8)), "drawer"),
        (FrontLook(width_m=0.45, height_m=0.72, bottom_m=0.12, handle=bar(8, 80)), "cabinet"),
        (FrontLook(width_m=0.9, height_m=0.72, bottom_m=0.12, handle=bar(8, 80), pair=True), "double_door_cabinet"),
        (FrontLook(width_m=0.45, height_m=0.6, bottom_m=1.4, handle=bar(8, 80)), "wall_cabinet"),
        (FrontLook(width_m=0.6, height_m=1.7, bottom_m=0.05, handle=bar(8, 200)), "refrigerator"),
        (FrontLook(width_m=0.6, height_m=0.7, bottom_m=0.1, handle=bar(200, 8)), "dishwasher"),
        (FrontLook(width_m=0.6, height_m=0.6, bottom_m=0.1, handle=bar(200, 8), dark=0.7), "oven"),
        (FrontLook(width_m=0.9, height_m=0.7, bottom_m=1.4, handle=bar(8, 80), pair=True), "double_door_wall_cabinet"),
        (FrontLook(width_m=0.4, height_m=0.36, bottom_m=0.1, handle=None), "drawer"),
        (
            FrontLook(width_m=0.49, height_m=0.28, bottom_m=0.66, handle=None, dark=0.9),
            "drawer",
        ),  # a black kitchen without handles
        (FrontLook(width_m=0.6, height_m=0.7, bottom_m=0.1, handle=None, dark=0.9), "cabinet"),
    ],
)
def test_size_position_and_handle_determine_the_category_of_a_front(look: FrontLook, category: str) -> None:
    named, usual = name_front(look)
    assert (named, usual) == (category, pytest.approx(1.0, abs=0.01))


@pytest.mark.parametrize(("width", "height", "bottom"), [(1.9, 0.08, 0.02), (1.4, 0.9, 0.9), (0.1, 0.8, 0.1), (0.5, 1.1, 0.7)])
def test_plinths_walls_and_fillers_get_a_low_front_score(width: float, height: float, bottom: float) -> None:
    assert name_front(FrontLook(width_m=width, height_m=height, bottom_m=bottom, handle=None))[1] < 0.2


@pytest.mark.parametrize(
    ("extent", "base", "category"),
    [((0.08, 0.08, 0.28), 0.9, "bottle"), ((0.09, 0.11, 0.1), 0.9, "mug"), ((0.5, 0.5, 0.9), 0.0, "chair")],
)
def test_size_determines_the_category_of_a_thing(extent: tuple[float, float, float], base: float, category: str) -> None:
    assert name_thing(np.array(extent), base) == category
