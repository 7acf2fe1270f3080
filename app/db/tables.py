"""The only table definitions. A change here needs a migration in alembic/versions; a test compares the two.

Times are seconds since 1970, UTC. Every update except jobs' progress also stores an event.
"""

from typing import Any

from sqlalchemy import JSON, BigInteger, Column, Index, Integer, UniqueConstraint, false
from sqlmodel import Field, SQLModel

from r2c2r_core.align.protocol import MATCHERS
from r2c2r_core.generate.stage import GENERATORS
from r2c2r_core.robot.arms import ARMS
from r2c2r_core.segment.stage import SEGMENTERS

BYTES = BigInteger().with_variant(Integer, "sqlite")  # more than 2 GiB; SQLite's integers have up to 64 bits anyway


class Project(SQLModel, table=True):
    """One recording with its state and options."""

    __tablename__ = "projects"

    id: str = Field(primary_key=True)  # random, never reused, as media are cached for ever under it
    name: str
    status: str  # importing | failed | ready
    created: float  # start of the upload, if it was uploaded
    updated: float
    source_name: str
    source_path: str | None = None  # absolute; the upload, or a recording on this machine
    work_path: str | None = None  # absolute; set if the workspace is outside the project's folder
    media_version: str = ""  # changes when the recording is read again
    capture: dict[str, Any] = Field(default_factory=dict, sa_column=Column(JSON, nullable=False))
    notices: list[str] = Field(default_factory=list, sa_column=Column(JSON, nullable=False))
    error: dict[str, Any] | None = Field(default=None, sa_column=Column(JSON))
    segmenter: str = Field(default=SEGMENTERS.default, sa_column_kwargs={"server_default": SEGMENTERS.default})
    generator: str = Field(default=GENERATORS.default, sa_column_kwargs={"server_default": GENERATORS.default})
    matcher: str = Field(default=MATCHERS.default, sa_column_kwargs={"server_default": MATCHERS.default})
    arm: str = Field(default=ARMS.default, sa_column_kwargs={"server_default": ARMS.default})
    register_depth: bool = Field(default=False, sa_column_kwargs={"server_default": false()})  # registered to colour when read
    scale: float = Field(default=1.0, sa_column_kwargs={"server_default": "1"})  # factor on lengths when read
    owner_id: int | None = Field(default=None, foreign_key="accounts.id", ondelete="SET NULL")  # its creator
    assignee_id: int | None = Field(default=None, foreign_key="accounts.id", ondelete="SET NULL")  # current assignee
    opinion_of: str | None = None  # the project of which it is a second opinion; may be deleted
    honeypot: bool = Field(
        default=False, sa_column_kwargs={"server_default": false()}
    )  # ground truth is known; this is visible to admins only
    members_only: bool = Field(default=False, sa_column_kwargs={"server_default": false()})  # members and admins only
    review_state: str = Field(default="draft", sa_column_kwargs={"server_default": "draft"})  # services/states.py
    tags: list[str] = Field(default_factory=list, sa_column=Column(JSON, nullable=False, server_default="[]"))
    checklist: list[dict[str, str]] = Field(  # names and categories of objects to be clicked
        default_factory=list, sa_column=Column(JSON, nullable=False, server_default="[]")
    )
    archived: bool = Field(default=False, sa_column_kwargs={"server_default": false()})  # completed: shown only on request
    trashed: float | None = None  # time of the move to the trash: hidden, with all files kept
    inputs: str = Field(default="", sa_column_kwargs={"server_default": ""})  # db/keys.py: key of all user input
    size_bytes: int = Field(default=0, sa_type=BYTES, sa_column_kwargs={"server_default": "0"})  # of its folder
    sized: float = Field(default=0.0, sa_column_kwargs={"server_default": "0"})  # time of that measurement


class Account(SQLModel, table=True):
    """A user account."""

    __tablename__ = "accounts"
    __table_args__ = (
        UniqueConstraint("name", name="uq_accounts_name"),
        Index("ix_accounts_subject", "subject", unique=True),
    )

    id: int | None = Field(default=None, primary_key=True)
    name: str  # lower case
    subject: str | None = None  # OpenID issuer and subject, never reassigned
    role: str  # annotator | reviewer | admin
    password: str  # argon2id, with its parameters and salt; empty: no password is accepted
    created: float


class Template(SQLModel, table=True):
    """Names and categories of objects, from which projects make checklists of objects to be clicked."""

    __tablename__ = "templates"
    __table_args__ = (UniqueConstraint("name", name="uq_templates_name"),)

    id: int | None = Field(default=None, primary_key=True)
    name: str
    objects: list[dict[str, str]] = Field(default_factory=list, sa_column=Column(JSON, nullable=False))
    who: str
    changed: float


class ProjectMember(SQLModel, table=True):
    """A member of a project, who may see it even if it is restricted to members."""

    __tablename__ = "project_members"

    project_id: str = Field(primary_key=True, foreign_key="projects.id", ondelete="CASCADE")
    account_id: int = Field(primary_key=True, foreign_key="accounts.id", ondelete="CASCADE")


class Seen(SQLModel, table=True):
    """The last event of a project that a user has read."""

    __tablename__ = "seen"

    project_id: str = Field(primary_key=True, foreign_key="projects.id", ondelete="CASCADE")
    account_id: int = Field(primary_key=True, foreign_key="accounts.id", ondelete="CASCADE")
    event: int  # the last read one; no foreign key, as it is a position in their order
    at: float


class SignIn(SQLModel, table=True):
    """One session of a browser; without an account, of the user who started the server."""

    __tablename__ = "sign_ins"

    digest: str = Field(primary_key=True)  # SHA-256 of the cookie's value: the database file alone gives no access
    account_id: int | None = Field(default=None, foreign_key="accounts.id", ondelete="CASCADE")
    created: float
    used: float  # to the hour


class ApiToken(SQLModel, table=True):
    """An API token for a program; without an account it acts for the user who started the server."""

    __tablename__ = "api_tokens"
    __table_args__ = (UniqueConstraint("digest", name="uq_api_tokens_digest"),)

    id: int | None = Field(default=None, primary_key=True)
    digest: str  # SHA-256: the database alone gives no access
    account_id: int | None = Field(default=None, foreign_key="accounts.id", ondelete="CASCADE")
    name: str  # its purpose
    scope: str  # metrics | read | annotator | reviewer | admin
    created: float
    used: float | None = None  # to the minute


class Webhook(SQLModel, table=True):
    """A webhook for one project, or an admin's for all; without an account, of the user who started the server."""

    __tablename__ = "webhooks"

    id: int | None = Field(default=None, primary_key=True)
    account_id: int | None = Field(default=None, foreign_key="accounts.id", ondelete="CASCADE")
    project_id: str | None = Field(default=None, foreign_key="projects.id", ondelete="CASCADE")
    url: str
    secret: str  # signs the messages, so it is stored in plain text
    created: float


class Delivery(SQLModel, table=True):
    """One message to a webhook, stored in the transaction of the announced change."""

    __tablename__ = "webhook_deliveries"
    __table_args__ = (
        Index("ix_webhook_deliveries_due", "due"),
        Index("ix_webhook_deliveries_webhook", "webhook_id"),
        {"sqlite_autoincrement": True},
    )

    id: int | None = Field(default=None, primary_key=True)
    webhook_id: int = Field(foreign_key="webhooks.id", ondelete="CASCADE")
    event: str  # run.finished | state.changed | test
    body: str  # JSON, as signed
    created: float
    attempts: int = 0
    due: float | None = None  # time of the next attempt; None: delivered, or given up
    delivered: float | None = None
    answer: str = ""  # to the last attempt


class LaunchKey(SQLModel, table=True):
    """The unused one-time key of a printed address."""

    __tablename__ = "launch_keys"

    digest: str = Field(primary_key=True)  # SHA-256: the database file alone gives no access
    created: float


class AuditEntry(SQLModel, table=True):
    """One audit entry: a sign-in, a refusal, or a change of an account. Append-only, except for the oldest of many refusals."""

    __tablename__ = "audit"
    __table_args__ = (Index("ix_audit_action", "action", "id"), {"sqlite_autoincrement": True})

    id: int | None = Field(default=None, primary_key=True)
    at: float
    action: str  # schemas.AuditAction
    account: str  # affected; no foreign key, as entries outlive accounts; "" if unknown or none
    who: str  # author
    client: str  # client address; "" for the command line
    detail: str


class SentChange(SQLModel, table=True):
    """An applied change with its idempotency key and answer, so that a repeated request does not apply it again."""

    __tablename__ = "sent_changes"

    digest: str = Field(primary_key=True)  # SHA-256 of sender and key
    request: str  # method and path
    project_id: str | None = Field(default=None, index=True)  # no foreign key, as it is stored before a new project
    at: float = Field(index=True)
    status: int | None = None  # None: the server stopped between the change and its answer
    answer: str = ""


class Upload(SQLModel, table=True):
    """An unfinished upload of a recording; its received size is that of its file in the uploads folder."""

    __tablename__ = "uploads"

    id: str = Field(primary_key=True)  # becomes the project's
    file_name: str
    name: str | None = None
    size: int = Field(sa_type=BYTES)
    modified: float | None = None  # modification time, which with name and size identifies the file
    who: str
    created: float


class SceneObject(SQLModel, table=True):
    """One annotated object."""

    __tablename__ = "objects"
    __table_args__ = (Index("ix_objects_project", "project_id"), {"sqlite_autoincrement": True})

    id: int | None = Field(default=None, primary_key=True)
    project_id: str = Field(foreign_key="projects.id", ondelete="CASCADE")
    name: str
    category: str
    colour: int  # index into the palette
    version: int = 1  # increased by every change
    deleted: bool = False
    frames: dict[str, Any] = Field(  # corrections by frame number: a mask as in prompts.json; None: not visible
        default_factory=dict, sa_column=Column(JSON, nullable=False, server_default="{}")
    )
    front: dict[str, Any] | None = Field(default=None, sa_column=Column(JSON(none_as_null=True)))  # drawn, as in prompts.json
    crop: dict[str, Any] | None = Field(default=None, sa_column=Column(JSON(none_as_null=True)))  # as in prompts.json
    masks_key: str = Field(default="", sa_column_kwargs={"server_default": ""})  # db/keys.py: of all inputs of its masks
    assignee: str | None = Field(default=None, index=True)  # current assignee, by name
    locked_by: str | None = None  # name of the user who locked it against changes
    inputs: str = Field(default="", sa_column_kwargs={"server_default": ""})  # db/keys.py: of all inputs of its results
    run_name: str = Field(default="", sa_column_kwargs={"server_default": ""})  # name in the last run; empty: unchanged

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
    view: dict[str, Any] | None = Field(default=None, sa_column=Column(JSON(none_as_null=True)))  # schemas.ViewerLook
    text: str
    who: str
    at: float
    resolved_by: str = ""
    resolved_at: float | None = None


class TrueLength(SQLModel, table=True):
    """A length measured in the room: of an object's side, or between two points."""

    __tablename__ = "true_lengths"
    __table_args__ = (Index("ix_true_lengths_project", "project_id"), {"sqlite_autoincrement": True})

    id: int | None = Field(default=None, primary_key=True)
    project_id: str = Field(foreign_key="projects.id", ondelete="CASCADE")
    object_id: int | None = Field(default=None, foreign_key="objects.id", ondelete="CASCADE")
    side: str = ""  # width | depth | height of the object
    points_world: list[list[float]] | None = Field(default=None, sa_column=Column(JSON(none_as_null=True)))
    scale: float  # of the project when the points were set; their coordinates are at this scale
    metres: float
    text: str  # description
    who: str
    at: float


class Event(SQLModel, table=True):
    """One change with author, time, old and new values. Append-only: undo and redo are events too."""

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
    text: str  # one line for display
    frame: int | None = None
    who: str
    at: float
    before: dict[str, Any] | None = Field(default=None, sa_column=Column(JSON))  # only differing keys: see db/history.py
    after: dict[str, Any] | None = Field(default=None, sa_column=Column(JSON))
    target: int | None = None  # the event undone or redone
    standing: str | None = None  # of a change of an object: done | undone | gone


class Job(SQLModel, table=True):
    """One job: an import, a sample, a run or variants."""

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
    attempts: int = 0  # since its last progress
    reached: int = Field(default=0, sa_column_kwargs={"server_default": "0"})  # maximum number of finished stages
    who: str = ""
    owner: str | None = None  # host, process and a random word of the server that runs it
    worker_pid: int | None = None
    worker_started: float | None = None  # the worker's creation time, as a pid alone may have been reused
    heartbeat: float | None = None  # last heartbeat of its owner, by the database's clock
    created: float
    started: float | None = None
    finished: float | None = None


class Part(SQLModel, table=True):
    """An object of a shared stage of a running job, which any seat may compute: jobs/sharing.py."""

    __tablename__ = "parts"
    __table_args__ = (UniqueConstraint("job_id", "stage", "name", name="uq_parts_object"), {"sqlite_autoincrement": True})

    id: int | None = Field(default=None, primary_key=True)
    job_id: int = Field(foreign_key="jobs.id", ondelete="CASCADE")
    stage: str
    name: str  # of the object, as in the job's prompts
    holder: str  # writer of the project's files, as in the store
    state: str  # waiting | running | stopping | done | failed
    at_least: int  # minimum number per process, where its seat's share allows, as its start takes time too
    owner: str | None = None  # of the process that computes it, in the format of Job.owner
    heartbeat: float | None = None  # last heartbeat of its owner for this part, by the database's clock
    attempts: int = 0
    log: str = ""  # output of its process; stored with the first of several parts of one process


class Seat(SQLModel, table=True):
    """A running process that takes jobs from a shared database."""

    __tablename__ = "seats"
    __table_args__ = (UniqueConstraint("owner", name="uq_seats_owner"),)

    id: int | None = Field(default=None, primary_key=True)
    owner: str  # as in its jobs
    version: str
    jobs: int  # maximum at a time
    began: float
    seen: float  # last heartbeat, by the database's clock
    draining: bool = False  # it takes no further jobs


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
    """An interval in which a project's live segmenter was working: preparing, proposing or computing masks."""

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
    inputs: str = Field(default="", sa_column_kwargs={"server_default": ""})  # of the project at the start of the run
