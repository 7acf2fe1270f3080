"""Array shapes are checked while the tests run; production pays nothing for them."""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")  # the suite runs two processes on two cores

from jaxtyping import install_import_hook

import tests.typechecker  # noqa: F401  # the hook looks it up as an attribute of `tests`

if os.environ.get("R2C2R_SHAPES", "1") == "1":
    install_import_hook(["r2c2r_core.geometry"], "tests.typechecker.checked")
