import functools
from pathlib import Path

import pytest

DATA = Path(__file__).resolve().parents[3] / "../shared/data"


@pytest.fixture(scope="session")
def real():
    """Factory of the folder of a real recording; the test is skipped if it is missing."""

    @functools.cache
    def find(name: str) -> Path:
        path = DATA / name
        if not path.exists():
            pytest.skip(f"the real recording {name} is not beside the checkout")
        return path.resolve()

    return find
