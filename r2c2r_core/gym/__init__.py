"""Gymnasium environments on bundles and their variants (extra `r2c2r[gym]`): `import r2c2r_core.gym` registers them.

Without gymnasium nothing is registered; no other package depends on it.
"""

from importlib.util import find_spec

if find_spec("gymnasium") is not None:
    from r2c2r_core.gym.registration import register_envs

    register_envs()
