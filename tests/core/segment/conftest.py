from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.model.capture import Capture
from r2c2r_core.segment.protocol import SegmentSession
from r2c2r_core.segment.stage import open_session
from tests.core.segment.scenes import kitchen

Truth = dict[str, dict[int, np.ndarray]]


@pytest.fixture(scope="package")
def boxes() -> tuple[Capture, Truth]:
    return kitchen()


@pytest.fixture(scope="package")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("segment")


@pytest.fixture(scope="package")
def session(boxes: tuple[Capture, Truth], cache: Path) -> SegmentSession:
    return open_session(boxes[0], cache)
