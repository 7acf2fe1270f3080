"""Release sweep of engines: every joint from every share of its travel, with the first failure described."""

from r2c2r_core.export.probes.releasing import release_everywhere

RANGES = {"hinge": (0.0, 2.0), "slide": (0.0, 0.5)}


def test_every_joint_is_released_at_five_positions_of_its_travel() -> None:
    seen: list[tuple[str, float]] = []

    def released(joint: str, position: float) -> float:
        seen.append((joint, position))
        return position

    assert release_everywhere(RANGES, released) == ""
    assert seen == [*(("hinge", 0.5 * k) for k in range(5)), *(("slide", 0.125 * k) for k in range(5))]


def test_a_joint_that_moves_away_is_reported_with_its_positions() -> None:
    problem = release_everywhere(RANGES, lambda joint, position: position - 0.05 if joint == "slide" else position)
    assert problem == "slide, released at 0, is at -0.05 after 10 steps"


def test_a_slow_fall_under_gravity_is_accepted() -> None:
    assert release_everywhere(RANGES, lambda joint, position: position - 0.007 if joint == "hinge" else position) == ""


def test_a_diverging_joint_is_reported_with_its_share_of_travel() -> None:
    problem = release_everywhere(RANGES, lambda joint, position: float("nan") if position > 1.0 else position)
    assert problem == "it diverges with hinge at 75%"
