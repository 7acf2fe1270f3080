"""Registration of the environments by name."""

from gymnasium.envs.registration import register, registry

STEPS = 300  # of 0.05 s, after which an episode is cut off
IDS = {"r2c2r/Open-v0": "r2c2r_core.gym.opening:OpenEnv", "r2c2r/PickPlace-v0": "r2c2r_core.gym.placing:PickPlaceEnv"}


def register_envs() -> None:
    """Register the environments with gymnasium, once."""
    for name, target in IDS.items():
        if name not in registry:
            register(id=name, entry_point=target, max_episode_steps=STEPS)
