"""The only table definitions. A change here needs a migration in alembic/versions; a test compares the two.

Times are seconds since 1970, UTC. Nothing but jobs' progress is ever updated without an event beside it.
"""

from typing import Any

from sqlalchemy import JSON, BigInteger, Column, Index, Integer, UniqueConstraint, false
from sqlmodel import Field, SQLModel

from r2c2r_core.align.protocol import MATCHERS
from r2c2r_core.generate.stage import GENERATORS
from r2c2r_core.robot.arms import ARMS
from r2c2r_core.segment.stage import SEGMENTERS

BYTES = BigInteger().with_variant(Integer, "sqlite")  # more than 2 GiB; SQLite's integers hold as much as they are given


class Project(SQLModel, table=True):
    """One recording and what became of it."""

    __tablename__ = "projects"

    id: str = Field(primary_key=True)  # random, never used twice: media are cached for ever under it
    name: str
    status: str  # importing | failed | ready
    created: float  # when its upload began, where it was uploaded
    updated: float
    source_name: str
    source_path: str | None = None  # absolute; the upload, or a recording on this machine
    work_path: str | None = None  # absolute; set when the workspace is not in the project's folder
    media_version: str = ""  # changes when the recording is read again
    capture: dict[str, Any] = Field(default_factory=dict, sa_column=Column(JSON, nullable=False))
    notices: list[str] = Field(default_factory=list, sa_column=Column(JSON, nullable=False))
    error: dict[str, Any] | None = Field(default=None, sa_column=Column(JSON))
    segmenter: str = Field(default=SEGMENTERS.default, sa_column_kwargs={"server_default": SEGMENTERS.default})
    generator: str = Field(default=GENERATORS.default, sa_column_kwargs={"server_default": GENERATORS.default})
    matcher: str = Field(default=MATCHERS.default, sa_column_kwargs={"server_default": MATCHERS.default})
    arm: str = Field(default=ARMS.default, sa_column_kwargs={"server_default": ARMS.default})
    register_depth: bool = Field(default=False, sa_column_kwargs={"server_default": false()})  # moved onto colour when read
    scale: float = Field(default=1.0, sa_column_kwargs={"server_default": "1"})  # on every length of the recording when read
    owner_id: int | None = Field(default=None, foreign_key="accounts.id", ondelete="SET NULL")  # who made it
    assignee_id: int | None = Field(default=None, foreign_key="accounts.id", ondelete="SET NULL")  # whose turn it is
    opinion_of: str | None = None  # a project of this recording, of which it is an independent one; it may be gone
    honeypot: bool = Field(
        default=False, sa_column_kwargs={"server_default": false()}
    )  # its truth is known; visible to admins only
    members_only: bool = Field(default=False, sa_column_kwargs={"server_default": false()})  # only they and admins see it
    review_state: str = Field(default="draft", sa_column_kwargs={"server_default": "draft"})  # services/states.py
    tags: list[str] = Field(default_factory=list, sa_column=Column(JSON, nullable=False, server_default="[]"))
    checklist: list[dict[str, str]] = Field(  # names and categories of objects that are to be clicked
        default_factory=list, sa_column=Column(JSON, nullable=False, server_default="[]")
    )
    archived: bool = Field(default=False, sa_column_kwargs={"server_default": false()})  # done with: not shown unless asked for
    trashed: float | None = None  # when it was moved to the trash: hidden, with all files kept
    inputs: str = Field(default="", sa_column_kwargs={"server_default": ""})  # db/keys.py: of everything a person gave
    size_bytes: int = Field(default=0, sa_type=BYTES, sa_column_kwargs={"server_default": "0"})  # of its folder
    sized: float = Field(default=0.0, sa_column_kwargs={"server_default": "0"})  # when that was measured


class Account(SQLModel, table=True):
    """A person who may sign in."""

    __tablename__ = "accounts"
    __table_args__ = (
        UniqueConstraint("name", name="uq_accounts_name"),
        Index("ix_accounts_subject", "subject", unique=True),
    )

    id: int | None = Field(default=None, primary_key=True)
    name: str  # lower case
    subject: str | None = None  # of an OpenID provider: the issuer, and whom it means for ever
    role: str  # annotator | reviewer | admin
    password: str  # argon2id, with its parameters and salt; empty: none opens it
    created: float


class Template(SQLModel, table=True):
    """Names and categories of objects, to be clicked in whatever project takes them over."""

    __tablename__ = "templates"
    __table_args__ = (UniqueConstraint("name", name="uq_templates_name"),)

    id: int | None = Field(default=None, primary_key=True)
    name: str
    objects: list[dict[str, str]] = Field(default_factory=list, sa_column=Column(JSON, nullable=False))
    who: str
    changed: float


class ProjectMember(SQLModel, table=True):
    """Somebody who may see a project that not everybody may see."""

    __tablename__ = "project_members"

    project_id: str = Field(primary_key=True, foreign_key="projects.id", ondelete="CASCADE")
    account_id: int = Field(primary_key=True, foreign_key="accounts.id", ondelete="CASCADE")


class Seen(SQLModel, table=True):
    """Up to where somebody has read what others did to a project."""

    __tablename__ = "seen"

    project_id: str = Field(primary_key=True, foreign_key="projects.id", ondelete="CASCADE")
    account_id: int = Field(primary_key=True, foreign_key="accounts.id", ondelete="CASCADE")
    event: int  # the last one; no foreign key: it is a place in their order
    at: float


class SignIn(SQLModel, table=True):
    """One browser that is let in; without an account it is that of whoever started the server."""

    __tablename__ = "sign_ins"

    digest: str = Field(primary_key=True)  # SHA-256 of the cookie's value: the database file alone gives no access
    account_id: int | None = Field(default=None, foreign_key="accounts.id", ondelete="CASCADE")
    created: float
    used: float  # to the hour


class ApiToken(SQLModel, table=True):
    """With which a program comes in; without an account it acts for whoever started the server."""

    __tablename__ = "api_tokens"
    __table_args__ = (UniqueConstraint("digest", name="uq_api_tokens_digest"),)

    id: int | None = Field(default=None, primary_key=True)
    digest: str  # SHA-256: the database alone gives no access
    account_id: int | None = Field(default=None, foreign_key="accounts.id", ondelete="CASCADE")
    name: str  # what it is for
    scope: str  # metrics | read | annotator | reviewer | admin
    created: float
    used: float | None = None  # to the minute


class Webhook(SQLModel, table=True):
    """An address that is told of a project, or, an admin's, of all; without an account it is whoever started the server's."""

    __tablename__ = "webhooks"

    id: int | None = Field(default=None, primary_key=True)
    account_id: int | None = Field(default=None, foreign_key="accounts.id", ondelete="CASCADE")
    project_id: str | None = Field(default=None, foreign_key="projects.id", ondelete="CASCADE")
    url: str
    secret: str  # signs what is posted: it is needed as it is
    created: float


class Delivery(SQLModel, table=True):
    """One message on its way to a webhook, stored with the change that it tells of."""

    __tablename__ = "webhook_deliveries"
    __table_args__ = (
        Index("ix_webhook_deliveries_due", "due"),
        Index("ix_webhook_deliveries_webhook", "webhook_id"),
        {"sqlite_autoincrement": True},
    )

    id: int | None = Field(default=None, primary_key=True)
    webhook_id: int = Field(foreign_key="webhooks.id", ondelete="CASCADE")
    event: str  # run.finished | state.changed
    body: str  # JSON, as it is signed
    created: float
    attempts: int = 0
    due: float | None = None  # when it is tried next; None: delivered, or given up
    delivered: float | None = None
    answer: str = ""  # to the last attempt


class LaunchKey(SQLModel, table=True):
    """The key of a printed address that nobody has opened yet."""

    __tablename__ = "launch_keys"

    digest: str = Field(primary_key=True)  # SHA-256: the database file alone gives no access
    created: float


class AuditEntry(SQLModel, table=True):
    """Who was let in or refused, and who changed whose account. Append-only, but for the oldest of many refusals."""

    __tablename__ = "audit"
    __table_args__ = (Index("ix_audit_action", "action", "id"), {"sqlite_autoincrement": True})

    id: int | None = Field(default=None, primary_key=True)
    at: float
    action: str  # schemas.AuditAction
    account: str  # whose; no foreign key: the record outlives the account; "" for an unknown one, or none
    who: str  # did it
    client: str  # the address it came from; "" for the command line
    detail: str


class SentChange(SQLModel, table=True):
    """A change that its sender marked with a key, and what was answered: sent again, it is not made again."""

    __tablename__ = "sent_changes"

    digest: str = Field(primary_key=True)  # SHA-256 of who sent it and the key
    request: str  # method and path
    project_id: str | None = Field(default=None, index=True)  # no foreign key: it is stored before a new project is
    at: float = Field(index=True)
    status: int | None = None  # None: the server stopped between the change and its answer
    answer: str = ""


class Upload(SQLModel, table=True):
    """A recording on its way in; its bytes are in the uploads folder, and how many they are is read from there."""

    __tablename__ = "uploads"

    id: str = Field(primary_key=True)  # becomes the project's
    file_name: str
    name: str | None = None
    size: int = Field(sa_type=BYTES)
    modified: float | None = None  # the file's own time of change: with name and size it tells that it is the same file
    who: str
    created: float


class SceneObject(SQLModel, table=True):
    """One object a person named."""

    __tablename__ = "objects"
    __table_args__ = (Index("ix_objects_project", "project_id"), {"sqlite_autoincrement": True})

    id: int | None = Field(default=None, primary_key=True)
    project_id: str = Field(foreign_key="projects.id", ondelete="CASCADE")
    name: str
    category: str
    colour: int  # index into the palette
    version: int = 1  # grows with every change
    deleted: bool = False
    frames: dict[str, Any] = Field(  # by their numbers: a mask as in prompts.json, or None: not visible
        default_factory=dict, sa_column=Column(JSON, nullable=False, server_default="{}")
    )
    front: dict[str, Any] | None = Field(default=None, sa_column=Column(JSON(none_as_null=True)))  # drawn: as in prompts.json
    crop: dict[str, Any] | None = Field(default=None, sa_column=Column(JSON(none_as_null=True)))  # as in prompts.json
    masks_key: str = Field(default="", sa_column_kwargs={"server_default": ""})  # db/keys.py: of what its masks depend on
    assignee: str | None = Field(default=None, index=True)  # whose turn it is, by name
    inputs: str = Field(default="", sa_column_kwargs={"server_default": ""})  # db/keys.py: of what a result depends on
    run_name: str = Field(default="", sa_column_kwargs={"server_default": ""})  # in the last run; empty: as now

    @property
    def result_name(self) -> str:
        """Name under which its results are stored: unaffected by a rename until the next run."""
        return self.run_name or self.name


class Point(SQLModel, table=True):
    """One click, in pixels of the stored RGB frame."""

    __tablename__ = "prompt_points"
    __table_args__ = (Index("ix_prompt_points_object", "object_id"), {"sqlite_autoincrement": True})

    id: int | None = Field(default=None, primary_key=True)
    object_id: int = Field(foreign_key="objects.id", ondelete="CASCADE")
    frame: int
    x: float
    y: float
    label: int  # 1 on the object, 0 off it


class Override(SQLModel, table=True):
    """Manual corrections of one object; object_id None is the scene."""

    __tablename__ = "overrides"
    __table_args__ = (UniqueConstraint("project_id", "object_id", name="uq_overrides_object"),)

    id: int | None = Field(default=None, primary_key=True)
    project_id: str = Field(foreign_key="projects.id", ondelete="CASCADE")
    object_id: int | None = Field(default=None, foreign_key="objects.id", ondelete="CASCADE")
    data: dict[str, Any] = Field(default_factory=dict, sa_column=Column(JSON, nullable=False))


class Verdict(SQLModel, table=True):
    """A reviewer's verdict on one candidate."""

    __tablename__ = "verdicts"
    __table_args__ = (UniqueConstraint("object_id", "candidate", name="uq_verdicts_candidate"),)

    id: int | None = Field(default=None, primary_key=True)
    object_id: int = Field(foreign_key="objects.id", ondelete="CASCADE")
    candidate: str
    verdict: str  # accepted | rejected
    reason: str = ""
    who: str
    at: float


class Comment(SQLModel, table=True):
    """A comment on a pixel of a frame, a point of the scene, an object, or the project."""

    __tablename__ = "comments"
    __table_args__ = (Index("ix_comments_project", "project_id"), {"sqlite_autoincrement": True})

    id: int | None = Field(default=None, primary_key=True)
    project_id: str = Field(foreign_key="projects.id", ondelete="CASCADE")
    object_id: int | None = Field(default=None, foreign_key="objects.id", ondelete="CASCADE")
    frame: int | None = None
    x: float | None = None
    y: float | None = None
    point_world: list[float] | None = Field(default=None, sa_column=Column(JSON))
    view: dict[str, Any] | None = Field(default=None, sa_column=Column(JSON(none_as_null=True)))  # how 3D was looked at
    text: str
    who: str
    at: float
    resolved_by: str = ""
    resolved_at: float | None = None


class TrueLength(SQLModel, table=True):
    """A length that somebody measured in the room, and what it is of: an object's side, or between two points."""

    __tablename__ = "true_lengths"
    __table_args__ = (Index("ix_true_lengths_project", "project_id"), {"sqlite_autoincrement": True})

    id: int | None = Field(default=None, primary_key=True)
    project_id: str = Field(foreign_key="projects.id", ondelete="CASCADE")
    object_id: int | None = Field(default=None, foreign_key="objects.id", ondelete="CASCADE")
    side: str = ""  # width | depth | height of the object
    points_world: list[list[float]] | None = Field(default=None, sa_column=Column(JSON(none_as_null=True)))
    scale: float  # the project's when the points were set: they lie where the world was as large
    metres: float
    text: str  # what it is of, in words
    who: str
    at: float


class Event(SQLModel, table=True):
    """Who changed what, when, from what to what. Append-only: undo and redo are events too."""

    __tablename__ = "events"
    __table_args__ = (
        Index("ix_events_object", "project_id", "object_id", "at"),
        Index("ix_events_standing", "project_id", "scope", "object_id", "standing"),
        Index("ix_events_target", "target"),
        {"sqlite_autoincrement": True},
    )

    id: int | None = Field(default=None, primary_key=True)
    project_id: str = Field(foreign_key="projects.id", ondelete="CASCADE")
    object_id: int | None = None
    scope: str  # prompts | review | proposals | project | state | comments
    action: str  # add point, rename … | undo | redo
    text: str  # one line for a person
    frame: int | None = None
    who: str
    at: float
    before: dict[str, Any] | None = Field(default=None, sa_column=Column(JSON))  # only what differs: see db/history.py
    after: dict[str, Any] | None = Field(default=None, sa_column=Column(JSON))
    target: int | None = None  # the event an undo or redo is about
    standing: str | None = None  # of a change of an object: done | undone | gone


class Job(SQLModel, table=True):
    """One piece of heavy work."""

    __tablename__ = "jobs"
    __table_args__ = (Index("ix_jobs_state", "state"), Index("ix_jobs_project", "project_id"), {"sqlite_autoincrement": True})

    id: int | None = Field(default=None, primary_key=True)
    project_id: str = Field(foreign_key="projects.id", ondelete="CASCADE")
    kind: str  # import | sample | run | vary
    state: str  # queued | running | cancelling | cancelled | failed | done
    payload: dict[str, Any] = Field(default_factory=dict, sa_column=Column(JSON, nullable=False))
    stage: str = ""
    stage_fraction: float = 0.0
    progress: float = 0.0
    eta_s: float | None = None
    message: str = ""
    error: dict[str, Any] | None = Field(default=None, sa_column=Column(JSON))
    log_path: str | None = None
    attempts: int = 0  # since it last got further
    reached: int = Field(default=0, sa_column_kwargs={"server_default": "0"})  # stages it ever finished
    who: str = ""
    owner: str | None = None  # host, process and a random word of the server that runs it
    worker_pid: int | None = None
    worker_started: float | None = None  # the worker's creation time: its pid alone may be another's by now
    heartbeat: float | None = None  # last heartbeat of its owner, by the database's clock
    created: float
    started: float | None = None
    finished: float | None = None


class Part(SQLModel, table=True):
    """An object of a stage of a running job, which any seat may compute; there while the stage is shared: jobs/sharing.py."""

    __tablename__ = "parts"
    __table_args__ = (UniqueConstraint("job_id", "stage", "name", name="uq_parts_object"), {"sqlite_autoincrement": True})

    id: int | None = Field(default=None, primary_key=True)
    job_id: int = Field(foreign_key="jobs.id", ondelete="CASCADE")
    stage: str
    name: str  # of the object, as the job's prompts have it
    holder: str  # who makes the project's files, as the store has it
    state: str  # waiting | running | stopping | done | failed
    at_least: int  # as many a process takes, where its seat's share is so many: its start takes time too
    owner: str | None = None  # of the process that computes it, as of a job
    heartbeat: float | None = None  # last heartbeat of its owner for this part, by the database's clock
    attempts: int = 0
    log: str = ""  # what its process wrote; of several that one process computed, the first has it


class Seat(SQLModel, table=True):
    """A process that takes jobs from a database that several share, while it lives."""

    __tablename__ = "seats"
    __table_args__ = (UniqueConstraint("owner", name="uq_seats_owner"),)

    id: int | None = Field(default=None, primary_key=True)
    owner: str  # as of its jobs
    version: str
    jobs: int  # at a time
    began: float
    seen: float  # last heartbeat, by the database's clock
    draining: bool = False  # it takes no further job


class Message(SQLModel, table=True):
    """A message between processes that share the database; deleted after minutes: db/channel.py."""

    __tablename__ = "messages"

    id: int | None = Field(default=None, sa_column=Column(BYTES, primary_key=True))
    at: float  # by the database's clock
    sender: str
    body: str


class JobEvent(SQLModel, table=True):
    """One line of a job's history."""

    __tablename__ = "job_events"
    __table_args__ = (Index("ix_job_events_job", "job_id"), {"sqlite_autoincrement": True})

    id: int | None = Field(default=None, primary_key=True)
    job_id: int = Field(foreign_key="jobs.id", ondelete="CASCADE")
    at: float
    kind: str  # state | stage | progress | error
    stage: str = ""
    fraction: float = 0.0
    text: str = ""


class Computing(SQLModel, table=True):
    """A time in which a project's live segmenter was at work: preparing, proposing or drawing masks."""

    __tablename__ = "computing"
    __table_args__ = (Index("ix_computing_project", "project_id"),)

    id: int | None = Field(default=None, primary_key=True)
    project_id: str = Field(foreign_key="projects.id", ondelete="CASCADE")
    began: float
    ended: float


class Bundle(SQLModel, table=True):
    """One finished bundle."""

    __tablename__ = "bundles"
    __table_args__ = (UniqueConstraint("project_id", "version", name="uq_bundles_version"),)

    id: int | None = Field(default=None, primary_key=True)
    project_id: str = Field(foreign_key="projects.id", ondelete="CASCADE")
    version: int
    path: str  # file name in the project's bundles folder
    sha256: str
    size: int = Field(sa_type=BYTES)
    created: float
    certificate: dict[str, Any] | None = Field(default=None, sa_column=Column(JSON))
    inputs: str = Field(default="", sa_column_kwargs={"server_default": ""})  # the project's, when the run began
