"""All results of one run, as the exporter needs them."""

from dataclasses import dataclass

from r2c2r_core.model.capture import Capture
from r2c2r_core.model.contradiction import Contradiction
from r2c2r_core.model.inputs import Overrides, Prompts
from r2c2r_core.model.mesh import CandidateSet
from r2c2r_core.model.placement import Placement
from r2c2r_core.model.scene import ArticulatedScene
from r2c2r_core.model.track import MaskTrack


@dataclass(frozen=True, slots=True, kw_only=True)
class StageRun:
    """Backend and settings of one stage's run."""

    name: str
    backend: str
    config: dict[str, object]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reconstruction:
    """One finished run. Objects that failed a stage are absent from the later nouns and named in `failures`."""

    capture: Capture
    prompts: Prompts
    overrides: Overrides
    tracks: tuple[MaskTrack, ...]
    candidates: tuple[CandidateSet, ...]
    placements: tuple[Placement, ...]
    scene: ArticulatedScene
    stages: tuple[StageRun, ...]
    failures: dict[str, str]  # object name -> one line
    contradictions: tuple[Contradiction, ...] = ()
