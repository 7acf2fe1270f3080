"""A failure in a step shared by all objects affects only the object it failed for, and is reported in one line."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from r2c2r_core.model.scene import ArticulatedScene
from r2c2r_core.synthesize import clearance, fillers, joints, layout, opening, runs, solve, stage, surroundings
from tests.core.synthesize.kitchen_units import Handle, Unit
from tests.core.synthesize.test_build_scene import built, the

RUN = [
    Unit("cab_l", "cabinet", (0, 0, 0.5), (0.6, 0.58, 0.7), handle=Handle(0.24, 0.2)),
    Unit("cab_r", "cabinet", (0.602, 0.004, 0.5), (0.6, 0.58, 0.7), handle=Handle(-0.24, 0.2)),
]
ALONE = Unit("far", "cabinet", (0, 3.0, 0.5), (0.6, 0.58, 0.7), yaw=1.0, handle=Handle(0.24, 0.2))
MUG = Unit("mug", "mug", (0.335, 3.0, 0.05), (0.1, 0.1, 0.1), kind="thing")


def failing(monkeypatch: pytest.MonkeyPatch, module: Any, name: str, when: Callable[..., bool]) -> None:
    """Make the module's function fail if `when` is true for its arguments."""
    real = getattr(module, name)

    def fails(*inputs: Any, **settings: Any) -> Any:
        if when(*inputs):
            raise np.linalg.LinAlgError("SVD did not converge")
        return real(*inputs, **settings)

    monkeypatch.setattr(module, name, fails)


def named(scene: ArticulatedScene, what: str) -> set[str]:
    """Objects with a warning about it, each with the reason."""
    lines = {item.name: [line for line in item.warnings if what in line] for item in scene.objects}
    assert all("LinAlgError: SVD did not converge" in line for found in lines.values() for line in found)
    return {name for name, found in lines.items() if found}


def changed(scene: ArticulatedScene, usual: ArticulatedScene) -> set[str]:
    """Clicked objects with another size, place or number of joints than in the scene in which nothing failed."""
    return {
        item.name
        for item, other in zip(scene.objects, usual.objects, strict=True)
        if item.fixture != "fixed_panel"
        and (
            len(item.joints) != len(other.joints)
            or not np.allclose(item.dimensions_m, other.dimensions_m)
            or not np.allclose(item.world_from_object.matrix, other.world_from_object.matrix)
        )
    }


def test_a_run_that_fails_to_straighten_is_the_only_one_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    usual = built(*RUN, ALONE)
    failing(monkeypatch, runs, "_run_yaw", lambda items, line, *_: items[line.members[0]].name == "far")
    scene = built(*RUN, ALONE)
    assert named(scene, "its run was not straightened") == {"far"}
    assert changed(scene, usual) <= {"far"}


def test_a_failing_filler_search_is_reported_only_for_its_object(monkeypatch: pytest.MonkeyPatch) -> None:
    usual = built(*RUN)
    failing(monkeypatch, fillers, "_excess", lambda item, *_: item.name == "cab_r")
    scene = built(*RUN)
    assert named(scene, "the search for a filler beside it failed") == {"cab_r"}
    assert changed(scene, usual) <= {"cab_r"}


def test_a_failing_support_search_is_reported_only_for_its_thing(monkeypatch: pytest.MonkeyPatch) -> None:
    usual = built(*RUN, MUG)
    failing(monkeypatch, layout, "_carries", lambda _, item: item.name == "mug")
    scene = built(*RUN, MUG)
    assert named(scene, "it was not put on its support") == {"mug"}
    assert changed(scene, usual) <= {"mug"}


def test_a_failing_neighbour_fit_is_reported_only_for_its_objects(monkeypatch: pytest.MonkeyPatch) -> None:
    pair = [
        Unit("other_l", "cabinet", (0, 3, 0.5), (0.6, 0.58, 0.7)),
        Unit("other_r", "cabinet", (0.602, 3, 0.5), (0.6, 0.58, 0.7)),
    ]
    usual = built(*RUN, *pair)
    failing(monkeypatch, solve, "_solved", lambda items, *_: items[0].name == "other_l")
    scene = built(*RUN, *pair)
    assert named(scene, "it was not fitted to its neighbours") == {"other_l", "other_r"}
    assert changed(scene, usual) <= {"other_l", "other_r"}


@pytest.mark.parametrize("step", ["outliers_of", "overlapping_pairs"])
def test_a_failing_overlap_search_is_reported_and_keeps_all_objects(step: str, monkeypatch: pytest.MonkeyPatch) -> None:
    failing(monkeypatch, layout, step, lambda *_: True)
    scene = built(*RUN)
    assert {"cab_l", "cab_r"} <= {item.name for item in scene.objects}
    assert any("LinAlgError: SVD did not converge" in line for line in scene.warnings)


@pytest.mark.parametrize("step", ["handle_hinge", "_from_neighbours"])
def test_a_failing_hinge_search_uses_the_category_default(step: str, monkeypatch: pytest.MonkeyPatch) -> None:
    failing(monkeypatch, joints, step, lambda item, *_: item.name == "bare")
    bare = Unit("bare", "cabinet", (0, 3, 0.5), (0.6, 0.58, 0.7))
    scene = built(*RUN, bare)
    assert named(scene, "hinge on the left by default") == {"bare"}
    assert len(the(scene, "cab_l").joints) == 1


def test_a_failing_travel_check_is_reported_only_for_its_joint(monkeypatch: pytest.MonkeyPatch) -> None:
    failing(monkeypatch, clearance, "free_travel", lambda item, *_: item.name == "cab_r")
    scene = built(*RUN)
    assert named(scene, "how far cab_r_door_joint opens was not checked") == {"cab_r"}


def test_a_failing_collision_box_keeps_all_objects(monkeypatch: pytest.MonkeyPatch) -> None:
    failing(monkeypatch, clearance, "link_boxes", lambda item, _: item.name == "counter")
    scene = built(*RUN, Unit("counter", "counter", (0.3, 0, 0.915), (1.3, 0.62, 0.04), kind="thing"))
    assert {"cab_l", "cab_r", "counter"} <= {item.name for item in scene.objects}


def test_a_failing_hinge_flip_is_reported_only_for_its_door(monkeypatch: pytest.MonkeyPatch) -> None:
    build = stage._fixture
    monkeypatch.setattr(opening, "_travel", lambda _: 0.0)  # as if nothing opened
    turned: list[str] = []

    def built_once(item: Any, hinge: Any, *further: Any) -> Any:
        if hinge is not None and "could not open" in hinge.reason:
            turned.append(item.name)
            raise np.linalg.LinAlgError("SVD did not converge")
        return build(item, hinge, *further)

    monkeypatch.setattr(stage, "_fixture", built_once)
    scene = built(Unit("bare", "cabinet", (0, 0, 0.5), (0.6, 0.58, 0.7)), ALONE)
    assert turned == ["bare"]
    assert named(scene, "a hinge on its other side was not tried") == {"bare"}


@pytest.mark.parametrize(
    ("step", "said"),
    [
        ("facets_of", "the search for worktops and plinths failed"),
        ("worktop", "no worktop was made over cab_l, cab_r"),
        ("plinths", "no plinth was made below cab_l, cab_r"),
    ],
)
def test_a_failing_worktop_or_plinth_is_left_out_with_a_warning(step: str, said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    failing(monkeypatch, surroundings, step, lambda *_: True)
    scene = built(*RUN)
    assert {"cab_l", "cab_r"} <= {item.name for item in scene.objects}
    assert f"{said}: LinAlgError: SVD did not converge" in scene.warnings


@pytest.mark.parametrize("step", ["_painted", "_clear"])
def test_a_plinth_that_fails_to_build_is_left_out_with_a_warning(step: str, monkeypatch: pytest.MonkeyPatch) -> None:
    failing(monkeypatch, stage if step == "_painted" else surroundings, step, lambda *_: True)
    scene = built(*RUN)
    assert {item.name for item in scene.objects} == {"cab_l", "cab_r"}
    assert "plinth_1 is left out: LinAlgError: SVD did not converge" in scene.warnings
