"""Box fit of an appliance from synthetic photographs and depth on its faces, from initial guesses centimetres off."""

import numpy as np
import pytest

from r2c2r_core.arrays import Points
from r2c2r_core.geometry.transforms import Rigid3, rotation_about_z
from r2c2r_core.kitchen.names import category_of
from r2c2r_core.segment.appliances import fit
from r2c2r_core.segment.appliances.edges import BACK, BOTTOM, FRONT, LEFT, RIGHT, TOP, YAW, Photo
from r2c2r_core.segment.appliances.faces import Patches
from r2c2r_core.segment.appliances.fit import Evidence, Params, Solution, covariance_of, refine_rear, solve
from r2c2r_core.tuning import tuned
from tests.core.segment.appliances.drawn import BACK_M, EYES, LEFT_M, LINE_Z, RIGHT_M, TOP_M, TRUE, WALL_Y, photo

KIND = category_of("microwave")
NOTHING = Patches(np.zeros((0, 3)), np.zeros(0, int), np.zeros(0, int), {})
FRONT_POSE = Rigid3(np.eye(3), np.zeros(3))
PIXEL_M = 0.0035  # at 1.5 m a pixel is 2 mm, and edges are drawn to half a pixel


def solved(
    start: np.ndarray,
    photos: list[Photo],
    world_from_front: Rigid3 | None = None,
    patches: Patches = NOTHING,
    support_m: float | None = None,
) -> Solution:
    evidence = Evidence(start, KIND, patches, WALL_Y, support_m, 0.0085)
    return solve(evidence, photos, world_from_front or FRONT_POSE)


def test_top_and_back_converge_from_a_wrong_line_and_the_wall_depth() -> None:
    start = TRUE.copy()
    start[[TOP, BACK]] = LINE_Z, 0.42
    found = solved(start, [photo(eye) for eye in EYES])
    assert found.box[TOP] == pytest.approx(TOP_M, abs=PIXEL_M)
    assert found.box[BACK] == pytest.approx(BACK_M, abs=0.006)  # seen at a grazing angle


def test_different_depths_are_compared_by_edges_at_the_finest_spread(monkeypatch: pytest.MonkeyPatch) -> None:
    """At the widest spread, a shadow on the wall behind is the likelier back."""

    def annealed(_: Evidence, __: list[Photo], ___: Rigid3, box: np.ndarray, spreads_m: tuple[float, ...]) -> Solution:
        coarse = spreads_m == tuned(Params).spreads_m[:1]
        return Solution(box, np.eye(7), -float(box[BACK]) if coarse else abs(float(box[BACK]) - BACK_M))

    monkeypatch.setattr(fit, "_annealed", annealed)
    start = TRUE.copy()
    start[BACK] = BACK_M + 0.01
    assert solved(start, [photo(EYES[0])]).box[BACK] == pytest.approx(BACK_M + 0.01)


@pytest.mark.parametrize("turn_deg", [1.4, -1.1])
def test_photo_edges_correct_yaw_and_sides_of_the_box(turn_deg: float) -> None:
    """Front and sides too, from an initial guess that is a centimetre off."""
    turn, start = np.radians(turn_deg), TRUE.copy()
    start[[LEFT, RIGHT]] = LEFT_M + 0.004, RIGHT_M - 0.004
    found = solved(start, [photo(eye) for eye in EYES], Rigid3(rotation_about_z(turn), np.array([0.006, 0.004, 0.0])))
    assert found.box[YAW] == pytest.approx(-turn, abs=np.radians(0.2))
    assert found.box[FRONT] == pytest.approx(-0.004, abs=PIXEL_M)
    assert found.box[LEFT] == pytest.approx(LEFT_M - 0.006, abs=PIXEL_M)
    assert found.box[RIGHT] == pytest.approx(RIGHT_M - 0.006, abs=PIXEL_M)


def test_a_correct_initial_box_stays_in_place() -> None:
    found = solved(TRUE, [photo(eye) for eye in EYES])
    assert abs(found.box[YAW]) < np.radians(0.15)
    np.testing.assert_allclose(found.box[1:5], TRUE[1:5], atol=PIXEL_M)


def test_depth_of_a_white_box_before_a_white_wall_is_uncertain() -> None:
    found = solved(TRUE, [photo(eye, 200, side_grey=200, tiles=False) for eye in EYES])
    assert depth_sigma(found) > tuned(Params).sure * KIND.depth.usual * KIND.depth.spread
    assert depth_sigma(solved(TRUE, [photo(eye) for eye in EYES])) < 0.01


def test_occluded_edges_do_not_move_the_box() -> None:
    start = TRUE.copy()
    start[BACK] = KIND.depth.usual
    found = solved(start, [photo(eye, hidden=True) for eye in EYES])
    np.testing.assert_allclose(found.box[[YAW, LEFT, RIGHT, FRONT, BACK]], start[[YAW, LEFT, RIGHT, FRONT, BACK]], atol=1e-3)


@pytest.mark.parametrize("off_m", [0.045, -0.02])
def test_a_lower_edge_near_the_support_snaps_to_the_support(off_m: float) -> None:
    """The line mistaken for the lower edge is that of the window or a seam of the worktop."""
    start = TRUE.copy()
    start[BOTTOM] = TRUE[BOTTOM] + off_m
    assert solved(start, [], support_m=float(TRUE[BOTTOM])).box[BOTTOM] == pytest.approx(TRUE[BOTTOM], abs=0.008)


@pytest.mark.parametrize("back_m", [0.30, 0.42])
def test_the_rear_of_a_box_is_where_depth_starts_to_pass_its_sides(back_m: float) -> None:
    evidence = Evidence(TRUE, KIND, NOTHING, WALL_Y, None, 0.0085, np.array([[0.355, 0.365]]))
    start = TRUE.copy()
    start[BACK] = back_m
    found = refine_rear(evidence, [photo(eye, 200, side_grey=200, tiles=False) for eye in EYES], FRONT_POSE, start)
    assert found.box[BACK] == pytest.approx(BACK_M, abs=0.006)


def test_a_hanging_box_keeps_its_lower_edge() -> None:
    hanging = solved(TRUE, [], support_m=float(TRUE[BOTTOM]) - 0.5)
    assert hanging.box[BOTTOM] == pytest.approx(TRUE[BOTTOM], abs=0.003)


@pytest.mark.parametrize("short_m", [0.02, 0.045])
def test_depth_beyond_a_line_on_the_front_moves_the_side_to_the_true_edge(short_m: float) -> None:
    start, seen = TRUE.copy(), Patches(*NOTHING[:3], {RIGHT: RIGHT_M - 0.01})
    start[RIGHT] = RIGHT_M - short_m
    assert solved(start, [photo(eye) for eye in EYES], patches=seen).box[RIGHT] == pytest.approx(RIGHT_M, abs=PIXEL_M)


def test_a_box_is_at_least_as_deep_as_the_depth_on_its_sides() -> None:
    usual = solved(TRUE, []).box[BACK]
    seen = Patches(*NOTHING[:3], {BACK: usual + 0.03})
    assert solved(TRUE, [], patches=seen).box[BACK] > usual + 0.02


def test_an_edge_without_depth_beside_it_stays_in_place() -> None:
    dark = Patches(*NOTHING[:3], {LEFT: LEFT_M + 0.3})
    assert solved(TRUE, [photo(eye) for eye in EYES], patches=dark).box[LEFT] == pytest.approx(LEFT_M, abs=PIXEL_M)


@pytest.mark.parametrize("turn_deg", [-4.0, 0.0, 3.0])
def test_depth_of_a_side_determines_the_yaw_of_a_mostly_glass_appliance(turn_deg: float) -> None:
    """Depth on a strip of keys and on the right side, with 3 mm of noise; no photographs."""
    rng, turn = np.random.default_rng(1), np.radians(turn_deg)
    keys = np.column_stack([rng.uniform(0.15, 0.25, 40), np.zeros(40), rng.uniform(-0.15, 0.15, 40)])
    side = np.column_stack([np.full(100, 0.25), rng.uniform(0.03, 0.35, 100), rng.uniform(-0.15, 0.15, 100)])
    points = np.concatenate([keys, side])
    points[:40, 1] += rng.normal(0, 0.003, 40)
    points[40:, 0] += rng.normal(0, 0.003, 100)
    patches = Patches(points @ rotation_about_z(turn).T, np.repeat([1, 0], [40, 100]), np.repeat([FRONT, RIGHT], [40, 100]), {})
    found = solved(TRUE, [], patches=patches)
    assert np.degrees(found.box[YAW]) == pytest.approx(turn_deg, abs=0.6)  # slightly biased towards the found plane
    assert found.box[RIGHT] == pytest.approx(0.25, abs=0.004)


def test_the_covariance_covers_centre_yaw_and_sizes() -> None:
    """Compared with finite differences, for the box of a rotated front."""
    box = np.array([0.3, -0.2, 0.4, 0.05, 0.5, -0.1, 0.4])
    world_from_front = Rigid3(rotation_about_z(0.7), np.array([1.0, 2.0, 0.5]))

    def measures(of: np.ndarray) -> np.ndarray:
        middle = np.array([of[1] + of[2], of[3] + of[4], of[5] + of[6]]) / 2
        centre = world_from_front.apply(rotation_about_z(of[0]) @ middle)
        return np.array([*centre, 0.7 + of[0], of[2] - of[1], of[4] - of[3], of[6] - of[5]])

    sigma = np.array([2.0, 1.0, 3.0, 1.0, 5.0, 2.0, 1.0]) * 1e-3
    slope = np.column_stack([(measures(box + 1e-5 * e) - measures(box - 1e-5 * e)) / 2e-5 for e in np.eye(7)])
    covariance = covariance_of(Solution(box, np.diag(sigma**-2), 0.0), world_from_front)
    np.testing.assert_allclose(covariance, slope @ np.diag(sigma**2) @ slope.T, atol=1e-12)


def test_more_depth_points_on_a_side_reduce_its_sigma() -> None:
    def side(count: int) -> Patches:
        points = np.column_stack([np.full(count, RIGHT_M), np.linspace(0.04, 0.3, count), np.zeros(count)])
        return on_the_right(points)

    few, many = (sigma_of(RIGHT, solved(TRUE, [], patches=side(count))) for count in (4, 36))
    assert many < 0.6 * few


def on_the_right(points: Points) -> Patches:
    return Patches(points, np.zeros(len(points), int), np.full(len(points), RIGHT), {})


def grid(x_m: tuple[float, float], z_m: tuple[float, float]) -> Points:
    x, z = np.meshgrid(np.arange(*x_m, 0.01) + 0.005, np.arange(*z_m, 0.03))
    return np.column_stack([x.ravel(), np.zeros(x.size), z.ravel()])


def depth_sigma(found: Solution) -> float:
    return float(np.sqrt(covariance_of(found, Rigid3(np.eye(3), np.zeros(3)))[5, 5]))


def sigma_of(parameter: int, found: Solution) -> float:
    return float(np.sqrt(np.linalg.inv(found.information)[parameter, parameter]))
