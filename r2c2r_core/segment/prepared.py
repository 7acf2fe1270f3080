"""Interface of a session to the finders: a prepared capture, its planes, its runs, and the objects of other clicks."""

from typing import NamedTuple, Protocol

from r2c2r_core.arrays import Points
from r2c2r_core.model.inputs import ObjectPrompt, PromptPoint
from r2c2r_core.segment.found import Found
from r2c2r_core.segment.planes import PlaneRegion
from r2c2r_core.segment.protocol import SegmentConfig
from r2c2r_core.segment.runs.run import Run
from r2c2r_core.segment.scene import Scene


class Hits(NamedTuple):
    """Clicks and the world points under them, one each; clicks that hit nothing are left out of both."""

    clicks: tuple[PromptPoint, ...]
    points: Points


class PreparedCapture(Protocol):
    """A prepared capture: its planes, their furniture runs, and the objects found on them."""

    scene: Scene
    planes: tuple[PlaneRegion, ...]
    config: SegmentConfig

    def find(self, prompt: ObjectPrompt) -> Found:
        """Object under the clicks; raises ObjectNotSeen, PromptError."""

    def run_of(self, region: PlaneRegion, margin_m: float = 0.0) -> Run | None:
        """Furniture run on a plane with a margin."""
