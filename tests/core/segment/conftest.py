import os
from pathlib import Path

import numpy as np
import pytest

from r2c2r_core.model.capture import Capture
from r2c2r_core.segment.protocol import SegmentSession
from r2c2r_core.segment.stage import open_session
from tests.core.segment.scenes import OUT_M, kitchen

Truth = dict[str, dict[int, np.ndarray]]
Filmed = tuple[Capture, Truth, SegmentSession]


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


@pytest.fixture(scope="module")
def drawn_out(tmp_path_factory: pytest.TempPathFactory) -> Filmed:
    """The middle drawer is pulled out in the last frames."""
    capture, truth = kitchen(OUT_M, from_step=10)
    return capture, truth, open_session(capture, tmp_path_factory.mktemp("drawn_out"))


@pytest.fixture(scope="module")
def looked_into(tmp_path_factory: pytest.TempPathFactory) -> Filmed:
    """The middle drawer is pulled out, before cameras that see the parcel in it."""
    capture, truth = kitchen(OUT_M, from_step=10, raised_m=0.6)
    return capture, truth, open_session(capture, tmp_path_factory.mktemp("looked_into"))
