"""What goes over the wire. Times are seconds since 1970; lengths are metres; pixels are of the stored RGB frame."""

from app.schemas.base import ErrorBody
from app.schemas.bundles import Bundle, BundleChange, BundleCheck, Certificate, Finding
from app.schemas.captures import CaptureFacts, FrameInfo
from app.schemas.jobs import Job, JobEvent, RunRequest, StageState
from app.schemas.masks import FrameMask, Lane, LaneEntry, LiveState, LiveStatus, MaskBits
from app.schemas.objects import (
    HistoryEntry,
    ObjectIn,
    ObjectPatch,
    ObjectPoints,
    Point,
    PointIn,
    PointPatch,
    PointsIn,
    PromptsFile,
    PromptsFileObject,
    PromptsFilePoint,
    SceneObject,
    SegmentState,
    Undone,
    UndoRequest,
)
from app.schemas.people import Credentials
from app.schemas.photos import ObjectPhotos, OverlayLook, OverlayOf, Photo
from app.schemas.projects import Deleted, ImportPath, Project, ProjectCounts, ProjectPatch, SampleRequest
from app.schemas.proposals import Proposal, ProposalIds, Proposals
from app.schemas.reviews import Candidate, CandidateGroup, OverrideData, OverridePatch, Placement, Reviewed, VerdictIn
from app.schemas.scenes import SceneItem, SceneJoint, SceneSummary, StageInfo
from app.schemas.states import Comment, CommentIn, CommentPatch, Figures, ReviewMove, ReviewStatus, ReviewStep
from app.schemas.system import Backend, Category, FolderEntry, FolderListing, SystemInfo
from app.schemas.uploads import Upload, UploadIn
from app.schemas.viewer import JointValues, ViewerSession, ViewerShow, ViewerShown

__all__ = [
    "Backend",
    "Bundle",
    "BundleChange",
    "BundleCheck",
    "Candidate",
    "CandidateGroup",
    "CaptureFacts",
    "Category",
    "Certificate",
    "Comment",
    "CommentIn",
    "CommentPatch",
    "Credentials",
    "Deleted",
    "ErrorBody",
    "Figures",
    "Finding",
    "FolderEntry",
    "FolderListing",
    "FrameInfo",
    "FrameMask",
    "HistoryEntry",
    "ImportPath",
    "Job",
    "JobEvent",
    "JointValues",
    "Lane",
    "LaneEntry",
    "LiveState",
    "LiveStatus",
    "MaskBits",
    "ObjectIn",
    "ObjectPatch",
    "ObjectPhotos",
    "ObjectPoints",
    "OverlayLook",
    "OverlayOf",
    "OverrideData",
    "OverridePatch",
    "Photo",
    "Placement",
    "Point",
    "PointIn",
    "PointPatch",
    "PointsIn",
    "Project",
    "ProjectCounts",
    "ProjectPatch",
    "PromptsFile",
    "PromptsFileObject",
    "PromptsFilePoint",
    "Proposal",
    "ProposalIds",
    "Proposals",
    "ReviewMove",
    "ReviewStatus",
    "ReviewStep",
    "Reviewed",
    "RunRequest",
    "SampleRequest",
    "SceneItem",
    "SceneJoint",
    "SceneObject",
    "SceneSummary",
    "SegmentState",
    "StageInfo",
    "StageState",
    "SystemInfo",
    "UndoRequest",
    "Undone",
    "Upload",
    "UploadIn",
    "VerdictIn",
    "ViewerSession",
    "ViewerShow",
    "ViewerShown",
]
