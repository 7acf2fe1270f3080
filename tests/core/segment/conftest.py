import os
from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.model.capture import Capture
from r2c2r_core.segment.protocol import SegmentSession
from r2c2r_core.segment.stage import open_session
from tests.core.segment.scenes import kitchen

Truth = dict[str, dict[int, np.ndarray]]


@pytest.fixture(scope="session")
def boxes() -> tuple[Capture, Truth]:
    return kitchen()


@pytest.fixture(scope="session")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Cache of the prepared boxes: one folder for all workers, which wait for each other."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "segment-boxes"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture(scope="session")
def session(boxes: tuple[Capture, Truth], cache: Path) -> SegmentSession:
    return open_session(boxes[0], cache)
