"""Base class of the environments: the gripper in a bundle's scene or one of its variants, actions and observations."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import cv2
import gymnasium
import numpy as np
from gymnasium import spaces

from r2c2r_core.arrays import Vector3
from r2c2r_core.errors import BundleError
from r2c2r_core.export.simulate import without_visuals
from r2c2r_core.geometry.transforms import Rigid3, rotation_about, rotation_about_z
from r2c2r_core.robot.opening import reset
from r2c2r_core.robot.rig import STROKE_M, Gripper, gripper_in, pose_of
from r2c2r_core.robot.view import Surfaces, aimed, look, surfaces_of
from r2c2r_core.variants.overlay import START

SHIFT_M, TURN_RAD = 0.04, 0.15  # motion of the tool's target for an action of 1, per step
TICKS = 5  # commands per step: 0.05 s
PICTURE = (128, 96)
Observation = Literal["state", "rgbd"]
_FIELD_RAD = 1.0
_FAR_M = 20.0
_MOST = 100.0  # bound of every state value
_LEASH_M = 0.06  # maximum distance between tool and target: beyond, the base would pull with full force long after


class RobotEnv(gymnasium.Env):  # type: ignore[misc]  # gymnasium is an extra: the type checker runs without it
    """Environment that starts with the gripper in front of its goal; see docs/how-to/robots.md for spaces, reward, success.

    `bundle` is a bundle's folder, or an output folder of `r2c2r vary`: then each episode uses a random variant, or the one
    named in `reset(options={"variant": "00003"})`. Variants without a solution are passed over; raises BundleError if none has
    one, or if the named one has none.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 20}  # noqa: RUF012  # gymnasium's own way

    def __init__(
        self,
        bundle: str | Path,
        state_size: int,
        *,
        observation: Observation = "state",
        grip_n: float = 40.0,
        render_mode: str | None = None,
    ) -> None:
        self.scenes = scenes_of(Path(bundle))
        self.render_mode = render_mode
        self._pictures = observation == "rgbd"
        self._grip_n = grip_n
        self._loaded: Path | None = None
        self._unfit: dict[Path, str] = {}  # reason by scene
        self._surfaces: Surfaces | None = None
        self.action_space = spaces.Box(-1.0, 1.0, (7,), np.float32)
        state = spaces.Box(-_MOST, _MOST, (state_size,), np.float32)
        self.observation_space = spaces.Dict({"state": state, **_picture_spaces()}) if self._pictures else state
        self._enter(self.scenes)  # a task that cannot be done is an error now, not hours into a training run

    def begin(self, seed: int | None, options: dict[str, Any] | None) -> None:
        """Enter the scene of the next episode."""
        super().reset(seed=seed)
        wanted = (options or {}).get("variant")
        number = int(self.np_random.integers(len(self.scenes)))
        scenes = [*self.scenes[number:], *self.scenes[:number]]
        if wanted is not None:
            scenes = [scene for scene in scenes if scene.stem == wanted]
        if not scenes:
            raise BundleError(f"variant {wanted}: no such variant", hint=f"there are {len(self.scenes)} scenes")
        self._enter(scenes)

    def prepare(self) -> str | None:
        """Plan the task in the rig's scene; the reason if it cannot be done there. Raises BundleError if it is in no scene."""
        raise NotImplementedError

    def _enter(self, scenes: Sequence[Path]) -> None:
        """Load the first scene in which the task can be done, in its initial state."""
        for scene in scenes:
            if scene not in self._unfit:
                self._load(scene)
                if (why := self.prepare()) is None:
                    return
                self._unfit[scene] = why
        where = f"{scenes[0].stem}: " if len(scenes) == 1 else f"none of {len(scenes)} variants can be used; {scenes[0].stem}: "
        raise BundleError(f"{where}{self._unfit[scenes[0]]}", hint="see r2c2r check --gripper")

    def _load(self, scene: Path) -> None:
        if scene != self._loaded:
            self.rig: Gripper = gripper_in(scene, None if self._drawn else without_visuals)  # one at a time: they are large
            self._loaded, self._surfaces = scene, None
        self.rig.grip_with(self._grip_n)
        reset(self.rig)
        start = [k for k in range(self.rig.model.nkey) if self.rig.model.key(k).name == START]
        if start:
            self.rig.data.qpos[:] = self.rig.model.key_qpos[start[0]]

    def put_before(self, goal: Rigid3, back_m: float) -> None:
        """Place the open gripper `back_m` in front of a pose, with a random offset and rotation."""
        import mujoco

        aside = self.np_random.uniform(-0.03, 0.03, 3)
        turn = rotation_about_z(float(self.np_random.uniform(-0.2, 0.2)))
        target = goal.translation - back_m * goal.rotation[:, 0] + aside
        self.target, self.width_m = Rigid3(turn @ goal.rotation, target), STROKE_M
        self.rig.put(self.target, self.width_m)
        mujoco.mj_forward(self.rig.model, self.rig.data)

    def move(self, action: np.ndarray) -> None:
        """Apply one action: shift and rotate the target in the world, drive the fingers to a width."""
        wanted = np.clip(np.asarray(action, dtype=np.float64), -1.0, 1.0)
        turn, angle = wanted[3:6], float(np.linalg.norm(wanted[3:6]))
        rotation = (
            rotation_about(turn / angle, TURN_RAD * angle) @ self.target.rotation if angle > 1e-9 else self.target.rotation
        )
        at = self.rig.world_from_tool.translation
        away = self.target.translation + SHIFT_M * wanted[:3] - at
        length = float(np.linalg.norm(away))
        self.target = Rigid3(rotation, at + away * min(1.0, _LEASH_M / max(length, 1e-9)))
        self.width_m = STROKE_M * (float(wanted[6]) + 1) / 2
        for _ in range(TICKS):
            self.rig.command(self.target, self.width_m)
            self.rig.step()

    def action_to(self, pose: Rigid3, width_m: float) -> np.ndarray:
        """The action that moves the target to a pose, or as far as one step allows."""
        shift = (pose.translation - self.target.translation) / SHIFT_M
        turn = cv2.Rodrigues(pose.rotation @ self.target.rotation.T)[0].ravel() / TURN_RAD
        length, angle = float(np.linalg.norm(shift)), float(np.linalg.norm(turn))
        parts = [shift / max(length, 1.0), turn / max(angle, 1.0), [2 * width_m / STROKE_M - 1]]
        return np.concatenate(parts).clip(-1.0, 1.0).astype(np.float32)

    def observed(self, state: np.ndarray) -> Any:
        """The observation: the state, with camera images if enabled."""
        flat = np.asarray(state, dtype=np.float32).clip(-_MOST, _MOST)
        if not self._pictures:
            return flat
        seen = self._look()
        return {
            "state": flat,
            "rgb": seen.rgb,
            "depth": seen.depth_m[..., None].astype(np.float32),
            "segmentation": seen.body[..., None],
        }

    def render(self) -> Any:
        """The scene in colour if render_mode is rgb_array, else None."""
        return self._look().rgb if self.render_mode == "rgb_array" else None

    def labels(self) -> dict[int, str]:
        """Body names by number in `segmentation`; -1 is background."""
        return {body: self.rig.model.body(body).name for body in range(self.rig.model.nbody)}

    @property
    def _drawn(self) -> bool:
        return self._pictures or self.render_mode is not None

    def _look(self) -> Any:
        if self._surfaces is None:
            self._surfaces = surfaces_of(self.rig.model)
        goal, outward = self.view()
        side = np.cross([0.0, 0.0, 1.0], outward)
        eye = goal + 1.3 * outward + 0.7 * side + np.array([0.0, 0.0, 0.5])
        camera, camera_from_world = aimed(eye, goal, PICTURE, _FIELD_RAD)
        return look(self._surfaces, self.rig.model, self.rig.data, camera, camera_from_world)

    def view(self) -> tuple[Vector3, Vector3]:
        """Camera target, and the horizontal direction from it to the camera."""
        raise NotImplementedError


def scenes_of(folder: Path) -> tuple[Path, ...]:
    """The scenes of a bundle's folder, or of a folder of variants."""
    variants = sorted((folder / "variants").glob("*.xml"))
    if variants:
        return tuple(variants)
    if (folder / "scene.xml").is_file():
        return (folder / "scene.xml",)
    raise BundleError(
        f"{folder}: neither scene.xml nor variants/ found", hint="give an unpacked bundle, or a folder written by r2c2r vary"
    )


def tool_state(rig: Gripper) -> np.ndarray:
    """Two of the tool's axes in the world, and the width between the pads in strokes."""
    pose = pose_of(rig.data.qpos[rig.axes])
    return np.array([*pose.rotation[:, 0], *pose.rotation[:, 1], rig.width_m / STROKE_M])


def _picture_spaces() -> dict[str, Any]:
    width, height = PICTURE
    return {
        "rgb": spaces.Box(0, 255, (height, width, 3), np.uint8),
        "depth": spaces.Box(0.0, _FAR_M, (height, width, 1), np.float32),
        "segmentation": spaces.Box(-1, 2**30, (height, width, 1), np.int32),
    }
