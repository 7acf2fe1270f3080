import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from r2c2r_core.errors import BundleError
from tests.core.robot.scenes import Bar, scene
from tests.core.robot.test_picking import scene as table

gymnasium = pytest.importorskip("gymnasium", reason="gymnasium is not installed: pip install 'r2c2r[gym]'")

import r2c2r_core.gym  # noqa: E402, F401  # registers the environments
from r2c2r_core.gym.scripted import scripted_actions  # noqa: E402


@pytest.fixture
def door(tmp_path: Path) -> Path:
    return scene(tmp_path, bar=Bar()).parent


@pytest.fixture
def block(tmp_path: Path) -> Path:
    return table(tmp_path).parent


def _open(bundle: Path, **options: Any) -> Any:
    return gymnasium.make("r2c2r/Open-v0", bundle=bundle, joint="front_joint", **options)


def _pick(bundle: Path, **options: Any) -> Any:
    return gymnasium.make("r2c2r/PickPlace-v0", bundle=bundle, thing="block", **options)


@pytest.mark.parametrize("observation", ["state", "rgbd"])
def test_both_environments_pass_the_gymnasium_checker(tmp_path: Path, observation: str) -> None:
    from gymnasium.utils.env_checker import check_env

    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    for env in (
        _open(scene(tmp_path / "a", bar=Bar()).parent, observation=observation, render_mode="rgb_array"),
        _pick(table(tmp_path / "b").parent, observation=observation, render_mode="rgb_array"),
    ):
        check_env(env.unwrapped)


def test_the_same_seed_repeats_an_episode_and_another_differs(door: Path) -> None:
    def episode(seed: int) -> list[Any]:
        env = _open(door)
        first, _ = env.reset(seed=seed)
        env.action_space.seed(seed)
        return [first, *(env.step(env.action_space.sample())[0] for _ in range(5))]

    np.testing.assert_array_equal(episode(3), episode(3))
    assert not np.array_equal(episode(3)[0], episode(4)[0])


@pytest.mark.parametrize("seed", range(3))
def test_the_scripted_policy_opens_the_door(door: Path, seed: int) -> None:
    assert _succeeds(_open(door), seed)


def test_the_scripted_policy_opens_a_drawer_without_a_handle(tmp_path: Path) -> None:
    assert _succeeds(_open(scene(tmp_path, kind="drawer").parent), 0)


@pytest.mark.parametrize("seed", range(3))
def test_the_scripted_policy_moves_the_object(block: Path, seed: int) -> None:
    assert _succeeds(_pick(block), seed)


def test_zero_actions_do_not_open_the_door(door: Path) -> None:
    env = _open(door)
    env.reset(seed=0)
    rewards = [env.step(np.zeros(7, np.float32))[1] for _ in range(20)]
    assert not env.unwrapped._info()["success"]
    assert abs(sum(rewards)) < 0.05


def test_vectorized_environments_have_batched_and_distinct_states(door: Path) -> None:
    envs = gymnasium.make_vec("r2c2r/Open-v0", num_envs=2, vectorization_mode="sync", bundle=door, joint="front_joint")
    first, _ = envs.reset(seed=0)
    after, rewards, *_ = envs.step(envs.action_space.sample())
    assert first.shape == after.shape == (2, 20)
    assert rewards.shape == (2,)
    assert not np.array_equal(first[0], first[1])


def test_an_episode_uses_the_requested_variant(tmp_path: Path) -> None:
    (tmp_path / "variants").mkdir()
    for name, frictionloss in (("00000", 0.1), ("00001", 5.0)):
        shutil.copy(scene(tmp_path, bar=Bar(), frictionloss=frictionloss), tmp_path / "variants" / f"{name}.xml")
    env = _open(tmp_path)
    for name, frictionloss in (("00000", 0.1), ("00001", 5.0)):
        env.reset(seed=0, options={"variant": name})
        rig = env.unwrapped.rig
        assert rig.model.dof_frictionloss[rig.model.joint("front_joint").dofadr[0]] == frictionloss
    with pytest.raises(BundleError, match="variant 7"):
        env.reset(seed=0, options={"variant": "7"})


def test_an_episode_passes_over_variants_without_a_solution(tmp_path: Path) -> None:
    (tmp_path / "variants").mkdir()
    for name, radius in (("00000", 0.05), ("00001", 0.03), ("00002", 0.05)):  # the stroke is 80 mm
        shutil.copy(table(tmp_path, radius=radius), tmp_path / "variants" / f"{name}.xml")
    env = _pick(tmp_path)
    for seed in range(4):
        env.reset(seed=seed)
        model = env.unwrapped.rig.model
        assert model.geom_size[model.body("block").geomadr[0], 0] == 0.03
    with pytest.raises(BundleError, match="00002: thing block: wider than 76 mm all round"):
        env.reset(options={"variant": "00002"})
    env.reset(options={"variant": "00001"})


def test_a_task_that_no_variant_allows_is_an_error_of_make(tmp_path: Path) -> None:
    (tmp_path / "variants").mkdir()
    for name in ("00000", "00001"):
        shutil.copy(table(tmp_path, radius=0.05), tmp_path / "variants" / f"{name}.xml")
    with pytest.raises(BundleError, match="none of 2 variants can be used; 00000: thing block: wider than"):
        _pick(tmp_path)


def test_a_missing_thing_is_an_error_of_make(block: Path) -> None:
    with pytest.raises(BundleError, match="thing mug: no such object; free objects: block"):
        gymnasium.make("r2c2r/PickPlace-v0", bundle=block, thing="mug")


def test_a_missing_joint_or_bundle_file_is_an_error_of_make(door: Path, tmp_path: Path) -> None:
    with pytest.raises(BundleError, match="joint lid: no such joint; choose one of: front_joint"):
        gymnasium.make("r2c2r/Open-v0", bundle=door, joint="lid")
    (tmp_path / "empty").mkdir()
    with pytest.raises(BundleError, match=r"neither scene\.xml nor variants/"):
        gymnasium.make("r2c2r/Open-v0", bundle=tmp_path / "empty", joint="lid")


def test_segmentation_labels_name_the_visible_bodies(block: Path) -> None:
    env = _pick(block, observation="rgbd")
    seen, _ = env.reset(seed=0)
    labels = env.unwrapped.labels()
    shown = {labels.get(int(number), "nothing") for number in np.unique(seen["segmentation"])}
    assert "gripper/base" in shown


def _succeeds(env: Any, seed: int) -> bool:
    _, info = env.reset(seed=seed)
    for action in _actions(env):
        assert env.action_space.contains(action)
        _, _, terminated, truncated, info = env.step(action)
        if terminated or truncated:
            break
    return bool(json.loads(json.dumps(info))["success"])


def _actions(env: Any) -> Iterator[np.ndarray]:
    return scripted_actions(env.unwrapped)
