"""What finding an object needs from a session."""

from typing import Protocol

from r2c2r_core.segment.planes import PlaneRegion
from r2c2r_core.segment.runs import Run
from r2c2r_core.segment.scene import Scene


class Workbench(Protocol):
    """What finding needs from a session."""

    scene: Scene
    planes: tuple[PlaneRegion, ...]

    def run_of(self, region: PlaneRegion, margin_m: float = 0.0) -> Run | None:
        """The furniture run on a plane, and this far around it."""
