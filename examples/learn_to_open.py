"""Learn to open a joint by imitation, on the CPU: python examples/learn_to_open.py FOLDER JOINT [DEMONSTRATIONS] [TRIALS]

FOLDER is an unpacked bundle, or the output of `r2c2r vary`. The scripted policy demonstrates, with noise on its actions so that
recoveries are demonstrated too; the learner repeats the action of the nearest demonstrated state. Prints how many episodes with
unseen seeds succeed, before and after.
"""

import sys

import gymnasium
import numpy as np

import r2c2r_core.gym  # noqa: F401  # registers the environments
from r2c2r_core.gym.scripted import scripted_actions

NOISE, LEAST_SPREAD = 0.2, 0.02


class Policy:
    """Nearest-neighbour policy: the action demonstrated in the nearest state; zero before training."""

    def __init__(self) -> None:
        self.states, self.actions = np.zeros((0, 20)), np.zeros((0, 7))

    def learn(self, states: np.ndarray, actions: np.ndarray) -> None:
        self.scale = states.std(axis=0) + LEAST_SPREAD
        self.states, self.actions = states / self.scale, actions

    def __call__(self, state: np.ndarray) -> np.ndarray:
        if not len(self.states):
            return np.zeros(7, np.float32)
        nearest = np.linalg.norm(self.states - state / self.scale, axis=1).argmin()
        return np.asarray(self.actions[nearest], np.float32)


def demonstration(env: gymnasium.Env, seed: int, rng: np.random.Generator) -> tuple[list[np.ndarray], list[np.ndarray]]:
    states, actions = [], []
    state, _ = env.reset(seed=seed)
    for action in scripted_actions(env.unwrapped):
        states.append(state)
        actions.append(action)
        noise = np.append(rng.normal(0, NOISE, 6), 0.0).astype(np.float32)
        state, _, terminated, truncated, _ = env.step((action + noise).clip(-1, 1))
        if terminated or truncated:
            break
    return states, actions


def succeeds(env: gymnasium.Env, policy: Policy, seed: int) -> bool:
    state, info = env.reset(seed=seed)
    for _ in range(200):
        state, _, terminated, truncated, info = env.step(policy(state))
        if terminated or truncated:
            break
    return bool(info["success"])


def main(folder: str, joint: str, demonstrations: str = "12", trials: str = "10") -> None:
    env, rng, policy = gymnasium.make("r2c2r/Open-v0", bundle=folder, joint=joint), np.random.default_rng(0), Policy()
    other = range(10_000, 10_000 + int(trials))
    print(f"before: {sum(succeeds(env, policy, seed) for seed in other)} of {trials}")
    shown = [demonstration(env, seed, rng) for seed in range(int(demonstrations))]
    policy.learn(*(np.concatenate([episode[part] for episode in shown]) for part in (0, 1)))
    print(f"after {demonstrations} demonstrations: {sum(succeeds(env, policy, seed) for seed in other)} of {trials}")


if __name__ == "__main__":
    if not 3 <= len(sys.argv) <= 5:
        sys.exit(__doc__)
    main(*sys.argv[1:])
