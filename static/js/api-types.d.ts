// Generated from the app's OpenAPI document by `python -m app.openapi_types`. Do not edit.

/** A new account. */
export interface AccountIn {
  name: string;
  role: "annotator" | "reviewer" | "admin";
  password: string;
}

/** An account as an admin sees it. */
export interface AccountInfo {
  name: string;
  role: "annotator" | "reviewer" | "admin";
  created: number;
  used: number | null;
  you: boolean;
}

/** Changes of an account; a new password ends the account's sessions. */
export interface AccountPatch {
  role?: "annotator" | "reviewer" | "admin" | null;
  password?: string | null;
}

/** An object of both projects, or of one; then the other one and the comparison are None. */
export interface Agreed {
  first: AgreedObject | null;
  second: AgreedObject | null;
  iou: number | null;
  frames: number;
  same_category: boolean | null;
}

/** An object in one of two projects. */
export interface AgreedObject {
  object: number;
  name: string;
  category: string;
  frames: number;
}

/** Agreement of two projects; objects with the largest disagreement first. */
export interface Agreement {
  first: Opinion;
  second: Opinion;
  frames: number;
  both: number;
  only_first: number;
  only_second: number;
  mean_iou: number | null;
  same_category: number;
  objects: Agreed[];
  unmasked: AgreedObject[];
}

/** A token, without its secret. */
export interface ApiToken {
  id: number;
  name: string;
  scope: "metrics" | "read" | "annotator" | "reviewer" | "admin";
  owner: string;
  created: number;
  used: number | null;
}

/** A new token: its purpose and scope. `read` permits no changes, `metrics` permits only /metrics. */
export interface ApiTokenIn {
  name: string;
  scope?: "metrics" | "read" | "annotator" | "reviewer" | "admin";
}

/** The new assignee; None clears the assignment. */
export interface AssigneeIn {
  name: string | null;
}

/** One entry of the audit log of sign-ins and accounts. */
export interface AuditEntry {
  id: number;
  at: number;
  action: "signed in" | "signed out" | "refused" | "added" | "removed" | "role" | "password" | "token made" | "token revoked" | "webhook made" | "webhook removed" | "honeypot";
  account: string;
  who: string;
  client: string;
  detail: string;
}

/** A page of the audit log, newest first, and the total number of entries. */
export interface AuditPage {
  entries: AuditEntry[];
  total: number;
}

/** One implementation of a stage. */
export interface Backend {
  name: string;
  summary: string;
  licence: string;
  licence_class: "open" | "restricted";
  available: boolean;
  reason: string;
}

/** An obstacle that keeps a joint from opening completely: a free object, or the part of another open joint. */
export interface BlockerVerdict {
  name: string;
  kind: string;
  position: number | null;
}

/** One finished bundle. */
export interface Bundle {
  version: number;
  url: string;
  file_name: string;
  sha256: string;
  size: number;
  created: number;
  passed: boolean | null;
  current: boolean;
}

/** One difference between two bundles; an empty `object` refers to the whole bundle. */
export interface BundleChange {
  object: string;
  text: string;
}

/** Result of a new check of a stored bundle. */
export interface BundleCheck {
  version: number;
  intact: boolean;
  findings: Finding[];
}

/** One scene format of a bundle. */
export interface BundleFormat {
  name: string;
  file: string;
  opened_by: string;
}

/** A bundle's content for robots. */
export interface BundleInside {
  version: number;
  assets: ObjectAsset[];
  robots: RobotTrial[];
  simulators: SimulatorLines[];
}

/** One candidate mesh with its evidence. */
export interface Candidate {
  id: string;
  generator: string;
  seed: number;
  assumes: string;
  watertight: boolean;
  faces: number;
  frames: number[];
  metrics: Record<string, number>;
  parameters: Record<string, number>;
  warnings: string[];
  verdict: "accepted" | "rejected" | null;
  verdict_reason: string;
  verdict_by: string;
  glb: string;
  thumbnail: string;
}

/** All candidates of one object, the automatic choice and its reason, and the users' verdicts and corrections. */
export interface CandidateGroup {
  object: number;
  name: string;
  run_name: string;
  category: string;
  assignee: string | null;
  chosen: string;
  chosen_by: string;
  reason: string;
  ranking: string[];
  accepted: string | null;
  candidates: Candidate[];
  placement: Placement | null;
  override: OverrideData;
  changed: boolean;
  version: number;
  can_undo: boolean;
  can_redo: boolean;
  can_regenerate: boolean;
}

/** Facts about the recording, shown before any work starts. Pictures: /media/{project}/scan/plan.png and view.png. */
export interface CaptureFacts {
  format: string;
  sha256: string;
  frame_count: number;
  width: number;
  height: number;
  depth_width: number;
  depth_height: number;
  duration_s: number | null;
  path_length_m: number;
  up_source: string;
  floor_found: boolean;
  verdict: string;
  remarks: CaptureRemark[];
  figures: CaptureFigure[];
  moments: CaptureMoment[];
}

/** One measured figure, formatted for display. */
export interface CaptureFigure {
  name: string;
  value: string;
}

/** Measures of one frame examined by the capture doctor. */
export interface CaptureMoment {
  frame_index: number;
  sharpness: number;
  depth_share: number;
  brightness: number;
  error_mm: number | null;
}

/** One problem of a recording, its severity, and a remedy. */
export interface CaptureRemark {
  verdict: string;
  cause: string;
  text: string;
  advice: string;
}

/** One line of the category table. */
export interface Category {
  name: string;
  label: string;
  joint: string;
  sideways: boolean;
}

/** The certificate in the newest bundle. */
export interface Certificate {
  version: number;
  current: boolean;
  passed: boolean;
  likeness: Likeness | null;
  findings: Finding[];
  loaders: LoaderVerdict[];
  joints: JointVerdict[];
  rest_penetration_m: number;
  drift_m: number;
  realtime_factor: number;
  things: ThingVerdict[];
  together_penetration_m: number | null;
}

/** The template whose objects form a project's checklist; None: no checklist. */
export interface ChecklistIn {
  template: number | null;
}

/** A comment with its position, and whether it is resolved. */
export interface Comment {
  object: number | null;
  frame: number | null;
  x: number | null;
  y: number | null;
  point_world: [number, number, number] | null;
  view: ViewerLookOutput | null;
  id: number;
  text: string;
  who: string;
  at: number;
  resolved_by: string;
  resolved_at: number | null;
}

/** A new comment. */
export interface CommentIn {
  object?: number | null;
  frame?: number | null;
  x?: number | null;
  y?: number | null;
  point_world?: [number, number, number] | null;
  view?: ViewerLookInput | null;
  text: string;
}

/** Resolve a comment, or open it again. */
export interface CommentPatch {
  resolved: boolean;
}

/** A name and its password. */
export interface Credentials {
  name: string;
  password: string;
}

/** A frame from which candidates were made, and the object's position in it. */
export interface Crop {
  frame: number;
  width: number;
  height: number;
  box: number[];
}

/** Result of deleting a project. */
export interface Deleted {
  freed_bytes: number;
}

/** One message to a webhook. */
export interface Delivery {
  id: number;
  event: "run.finished" | "state.changed" | "test";
  body: string;
  created: number;
  attempts: number;
  due: number | null;
  delivered: number | null;
  answer: string;
}

/** Surface difference of a candidate from another one, aligned by the filmed side. */
export interface Difference {
  candidate: string;
  share: number;
  most: number;
}

/** Differences between candidates. Turntables: /media/{project}/candidates/{object}/{candidate}/turns.png?against={candidate}, 24 pictures from left to right. */
export interface Differences {
  against: string;
  tolerance: number;
  longest_m: number | null;
  candidates: Difference[];
  crops: Crop[];
}

/** An object that may differ from the filmed one, and the reason. */
export interface Doubt {
  object: string;
  why: string;
}

/** A plane to scale. Cells are counted from its top left corner, to the right and down; axes are unit vectors. */
export interface Elevation {
  id: number;
  url: string;
  cell_m: number;
  columns: number;
  rows: number;
  origin_m: number[];
  right: number[];
  down: number[];
  top_m: number;
  upright: ElevationLines;
  level: ElevationLines;
  cells: number[][];
}

/** Line evidence in one direction, to which drawn edges snap. */
export interface ElevationLines {
  block: number;
  blocks: number;
  positions: number;
  clarity: string;
}

/** All elevations, largest first and walls last; none until the live segmenter has rendered them. */
export interface Elevations {
  drawn: boolean;
  items: Elevation[];
}

/** Body of every error response; `current` is the stored state when the kind is `conflict`. */
export interface ErrorBody {
  kind: string;
  message: string;
  hint: string;
  current: unknown;
}

/** Effort spent on the project so far; times in seconds. */
export interface Figures {
  objects: number;
  clicks: number;
  clicks_per_object: number | null;
  verdicts: number;
  automatic_kept: number | null;
  upload_to_approval_s: number | null;
  computing_s: number;
  age_s: number;
}

/** One finding of the linter or the simulation. */
export interface Finding {
  rule: string;
  severity: string;
  where: string;
  message: string;
}

/** One entry of a folder from which a recording may be imported. */
export interface FolderEntry {
  name: string;
  path: string;
  folder: boolean;
  size: number | null;
}

/** A folder below an allowed root. */
export interface FolderListing {
  path: string;
  parent: string | null;
  entries: FolderEntry[];
}

/** The flat front of an object, as used for its masks. */
export interface FoundFront {
  object: number;
  corners_m: number[][];
  handle: PromptsFileHandle | null;
  certainty: number | null;
  suggested: string;
  edges: number[];
}

/** The camera of a frame in the recording's own world. */
export interface FrameCamera {
  width: number;
  height: number;
  fx: number;
  fy: number;
  cx: number;
  cy: number;
  camera_from_capture: number[][];
}

/** Correction of an object in one frame: a fixed mask, or None: not visible there. */
export interface FrameIn {
  mask: PromptsFileMask | null;
}

/** One frame; `index` is its number in the recording. Image: /media/{project}/frames/{index}.jpg?w=960&v={media_version}. */
export interface FrameInfo {
  index: number;
  timestamp_s: number | null;
  width: number;
  height: number;
  sharpness: number;
  camera: number[];
}

/** One object's mask on one frame. */
export interface FrameMask {
  object: number;
  frame: number;
  confidence: number;
  source: "live" | "run";
  mask: MaskBits;
}

/** A frame in which a user corrected the object. */
export interface FrameSaid {
  frame: number;
  visible: boolean;
}

/** One change with its author and time. */
export interface HistoryEntry {
  id: number;
  object: number | null;
  scope: string;
  action: string;
  text: string;
  frame: number | null;
  who: string;
  at: number;
  undone: boolean;
}

/** A stored honeypot. */
export interface Honeypot {
  project: string;
  name: string;
  person: string | null;
  review_state: "draft" | "ready" | "in review" | "changes requested" | "approved";
  made: number;
}

/** A new honeypot: the user to whose queue it is added, and its displayed name. */
export interface HoneypotIn {
  person: string;
  name: string;
}

/** The user's score on a honeypot. */
export interface HoneypotScore {
  found: number;
  extra: number;
  mean_iou: number | null;
  same_category: number;
  objects: TrueObject[];
}

/** A recording on this machine. */
export interface ImportPath {
  path: string;
  name?: string | null;
}

/** The current user's inbox; each project is in one of the first two lists. */
export interface Inbox {
  returned: InboxProject[];
  assigned: InboxProject[];
  objects: InboxObject[];
  mentions: InboxMention[];
}

/** An open comment that names you. */
export interface InboxMention {
  project: string;
  project_name: string;
  comment: Comment;
}

/** An object that waits for you. */
export interface InboxObject {
  project: string;
  project_name: string;
  review_state: "draft" | "ready" | "in review" | "changes requested" | "approved";
  object: number;
  name: string;
  category: string;
  at: number;
}

/** A project that waits for you; author, time and reason of its current state. */
export interface InboxProject {
  id: string;
  name: string;
  review_state: "draft" | "ready" | "in review" | "changes requested" | "approved";
  who: string;
  at: number;
  reason: string;
}

/** One job: an import, a sample, a run or variants. */
export interface Job {
  id: number;
  project: string;
  project_name: string;
  kind: "import" | "sample" | "run" | "vary";
  state: "queued" | "running" | "cancelling" | "cancelled" | "failed" | "done";
  stage: string;
  stage_fraction: number;
  stages: StageState[];
  progress: number;
  eta_s: number | null;
  message: string;
  error: ErrorBody | null;
  no_retry: string;
  position: number | null;
  attempts: number;
  who: string;
  has_log: boolean;
  created: number;
  started: number | null;
  finished: number | null;
}

/** One line of a job's history. */
export interface JobEvent {
  id: number;
  at: number;
  kind: string;
  stage: string;
  fraction: number;
  text: string;
}

/** Joint positions; they are clamped to the limits. */
export interface JointValues {
  values: Record<string, number>;
}

/** One joint's sweep and drive test. */
export interface JointVerdict {
  joint: string;
  deepest_penetration_m: number;
  travel_reached: number;
  cavity_open: number | null;
  blocked_by: BlockerVerdict[];
}

/** Frames with a mask of an object, and the confidence in each. */
export interface Lane {
  object: number;
  state: "none" | "waiting" | "running" | "partial" | "done" | "failed";
  source: "live" | "run" | "none";
  complete: boolean;
  frames: number[];
  confidences: number[];
}

/** The part moved by a joint of the object: its front as a box, closed, and the joint axis. */
export interface Leaf {
  joint: string;
  part: string;
  type: "revolute" | "prismatic";
  most: number;
  pose: number[][];
  size_m: number[];
  axis: number[];
  pivot: number[];
  opening: Opening | null;
}

/** An object made from the scan that the user does not want, or that the last run did not make. */
export interface LeftOut {
  object: number;
  name: string;
}

/** Plausibility of the scene as a model of the filmed one: passed, doubtful or failed. */
export interface Likeness {
  state: string;
  doubts: Doubt[];
}

/** An object to be clicked. */
export interface ListedObject {
  name: string;
  category: string;
}

/** The project's live segmenter. */
export interface LiveStatus {
  state: "off" | "starting" | "preparing" | "ready" | "failed";
  fraction: number;
  text: string;
  error: ErrorBody | null;
}

/** One loader's verdict; one that is not installed is `not tried`. */
export interface LoaderVerdict {
  loader: string;
  state: string;
  detail: string;
  steps_per_s: number[][];
}

/** How far a joint stands open in one frame. */
export interface MarkedState {
  frame: number;
  state: number;
}

/** A mask at preview size: base64 of zlib of the bits of its box, row by row without padding, high bit first. */
export interface MaskBits {
  width: number;
  height: number;
  left: number;
  top: number;
  box_width: number;
  box_height: number;
  bits: string;
}

/** New visibility of a project; its owner can always see it. */
export interface MembersIn {
  members_only: boolean;
  members?: string[];
}

/** Preview of an uploaded mesh as a candidate: repaired, but neither placed nor scaled. */
export interface MeshLook {
  name: string;
  size: number[];
  object_size_m: number[] | null;
  triangles: number;
  notes: string[];
  picture: string;
}

/** A new token with its secret, which is shown only once. */
export interface NewApiToken {
  id: number;
  name: string;
  scope: "metrics" | "read" | "annotator" | "reviewer" | "admin";
  owner: string;
  created: number;
  used: number | null;
  secret: string;
}

/** A new webhook, with the secret that signs its messages, which is shown only once. */
export interface NewWebhook {
  id: number;
  url: string;
  project: string | null;
  project_name: string;
  owner: string;
  created: number;
  answer: string;
  delivered: number | null;
  secret: string;
}

/** Changes of a project by others since your last visit, newest first. */
export interface News {
  since: number | null;
  last: number;
  people: PersonsChanges[];
  entries: HistoryEntry[];
}

/** One object of a bundle, to be downloaded by itself. */
export interface ObjectAsset {
  name: string;
  category: string;
  formats: string[];
  url: string;
}

/** A new object; without a name it gets its category and the next number. */
export interface ObjectIn {
  name?: string | null;
  category?: string;
  points?: PointIn[];
  front?: PromptsFileFrontInput | null;
}

/** Changes of an object; a drawn front, a crop box and the assignee can also be removed. With `version`, refused if it was changed since that version. */
export interface ObjectPatch {
  name?: string | null;
  category?: string | null;
  colour?: number | null;
  front?: PromptsFileFrontInput | null;
  crop?: PromptsFileCrop | null;
  assignee?: string | null;
  locked?: boolean | null;
  version?: number | null;
}

/** Photos for checking an object, entire views first, then the most confident; its box in the finished scene, if any. Overlays: /media/{project}/overlay/{object}/{frame}.png?of=fitted&look=ghost&v={version}. */
export interface ObjectPhotos {
  photos: Photo[];
  version: string;
  of: ("placed" | "primitive" | "fitted")[];
  world_from_object: number[][] | null;
  dimensions_m: number[] | null;
  leaves: Leaf[];
}

/** An object's shape from masks and depth: points around their centre, +Z up. */
export interface ObjectPoints {
  count: number;
  frames: number;
  centre_m: number[];
  size_m: number[];
  around: PromptsFileCrop | null;
  xyz_mm: string;
  rgb: string;
}

/** Joint position of a leaf in a frame that shows it: rad or m from closed; null if unknown. */
export interface OpenState {
  frame: number;
  value: number | null;
  sigma: number | null;
}

/** Filmed motion of a leaf of an object. */
export interface Opening {
  object: number;
  part: string;
  kind: "revolute" | "prismatic";
  largest: number;
  source: "measured" | "at_least" | "inferred" | "default" | "person";
  states: OpenState[];
}

/** A project on the same recording. */
export interface Opinion {
  project: string;
  name: string;
  assignee: string | null;
  review_state: "draft" | "ready" | "in review" | "changes requested" | "approved";
  objects: number;
  updated: number;
}

/** Assignee of a copy of the recording; None: not assigned. */
export interface OpinionIn {
  name: string | null;
}

/** Manual corrections of one object; None: computed value. */
export interface OverrideData {
  candidate: string | null;
  hinge: "left" | "right" | "top" | "bottom" | null;
  dimensions_m: [number, number, number] | null;
  pose: number[][] | null;
  joint_lower: number | null;
  joint_upper: number | null;
  joints: Record<string, [number | null, number | null]>;
  states: Record<string, MarkedState[]>;
  rejected: string[];
  regenerate: number;
  built_as: string | null;
  left_out: boolean;
  colour: [number, number, number] | null;
}

/** The fields that are present are set; null clears. */
export interface OverridePatch {
  candidate?: string | null;
  hinge?: "left" | "right" | "top" | "bottom" | null;
  dimensions_m?: [number, number, number] | null;
  pose?: number[][] | null;
  joint_lower?: number | null;
  joint_upper?: number | null;
  joints?: Record<string, [number | null, number | null]> | null;
  states?: Record<string, MarkedState[]> | null;
  regenerate?: number | null;
  built_as?: string | null;
  left_out?: boolean | null;
  colour?: [number, number, number] | null;
  rerun?: boolean;
  version?: number | null;
}

/** Change of one's own password. */
export interface PasswordChange {
  old: string;
  new: string;
}

/** Number of changes by one user. */
export interface PersonsChanges {
  who: string;
  changes: number;
}

/** A frame that shows the object well, with its camera. */
export interface Photo {
  width: number;
  height: number;
  fx: number;
  fy: number;
  cx: number;
  cy: number;
  frame: number;
  camera_from_world: number[][];
  confidence: number;
  box: number[];
  whole: boolean;
  states: PhotoState[];
}

/** Filmed joint position in a photo: rad or m; null if unknown. */
export interface PhotoState {
  joint: string;
  type: "revolute" | "prismatic";
  value: number | null;
  sigma: number | null;
}

/** Placement of the chosen candidate, with its evidence. */
export interface Placement {
  candidate: string;
  scale: number;
  translation_m: number[];
  matches: number;
  inliers: number;
  rms_m: number | null;
  mask_iou: number;
  condition: number;
  unsure: boolean;
  runner_up: number | null;
  runner_up_turn_deg: number | null;
  spread: PoseSpread | null;
  method: string;
  votes: Record<string, number>;
  warnings: string[];
}

/** A stored click. */
export interface Point {
  id: number;
  frame: number;
  x: number;
  y: number;
  label: 0 | 1;
}

/** A click; refused outside the frame. */
export interface PointIn {
  frame: number;
  x: number;
  y: number;
  label?: 0 | 1;
}

/** A moved or flipped click. */
export interface PointPatch {
  x?: number | null;
  y?: number | null;
  label?: 0 | 1 | null;
}

/** Clicks that belong together: one change, one undo. */
export interface PointsIn {
  points: PointIn[];
}

/** Uncertainty of a pose: standard deviations, each in the least constrained direction. */
export interface PoseSpread {
  turn_deg: number;
  shift_m: number;
  scale: number;
}

/** One project, with the capture doctor's findings on its recording. */
export interface Project {
  id: string;
  name: string;
  status: "importing" | "failed" | "ready";
  created: number;
  updated: number;
  source_name: string;
  media_version: string;
  frame_count: number;
  error: ErrorBody | null;
  counts: ProjectCounts;
  job: Job | null;
  result: "none" | "stale" | "current";
  bundle: Bundle | null;
  thumbnail: string | null;
  size_bytes: number;
  segmenter: string;
  generator: string;
  matcher: string;
  arm: string;
  review_state: "draft" | "ready" | "in review" | "changes requested" | "approved";
  tags: string[];
  archived: boolean;
  assignee: string | null;
  capture: CaptureFacts | null;
  notices: string[];
  register_depth: boolean;
  scale: number;
  checklist: ListedObject[];
  awaits_recording: boolean;
}

/** Counts of a project's content. */
export interface ProjectCounts {
  objects: number;
  points: number;
  accepted: number;
  rejected: number;
  open_comments: number;
}

/** Size of a project's export file. */
export interface ProjectFileOffer {
  size_bytes: number;
  recording_bytes: number | null;
}

/** Visibility of a project: everybody, or only its owner, its members and admins. */
export interface ProjectMembers {
  members_only: boolean;
  owner: string | null;
  members: string[];
  may_change: boolean;
  accounts: string[];
}

/** Changes of a project: name, tags, archive state, or backends of its stages. */
export interface ProjectPatch {
  name?: string | null;
  tags?: string[] | null;
  archived?: boolean | null;
  segmenter?: string | null;
  generator?: string | null;
  matcher?: string | null;
  arm?: string | null;
}

/** A project as in the list of all: its recording, state and results. */
export interface ProjectSummary {
  id: string;
  name: string;
  status: "importing" | "failed" | "ready";
  created: number;
  updated: number;
  source_name: string;
  media_version: string;
  frame_count: number;
  error: ErrorBody | null;
  counts: ProjectCounts;
  job: Job | null;
  result: "none" | "stale" | "current";
  bundle: Bundle | null;
  thumbnail: string | null;
  size_bytes: number;
  segmenter: string;
  generator: string;
  matcher: string;
  arm: string;
  review_state: "draft" | "ready" | "in review" | "changes requested" | "approved";
  tags: string[];
  archived: boolean;
  assignee: string | null;
}

/** prompts.json. */
export interface PromptsFileInput {
  version: 1 | 2 | 3;
  objects: PromptsFileObjectInput[];
}

/** prompts.json. */
export interface PromptsFileOutput {
  version: 1 | 2 | 3;
  objects: PromptsFileObjectOutput[];
}

/** A box around a thing: what is found outside is none of it. */
export interface PromptsFileCrop {
  corner_m: number[];
  edges_m: number[][];
}

/** The corrected state of an object in one frame. */
export interface PromptsFileFrame {
  frame: number;
  mask: PromptsFileMask | null;
}

/** A front's rectangle, drawn in the elevation of its run: used exactly as it is. */
export interface PromptsFileFrontInput {
  corners_m: number[][];
  handle?: PromptsFileHandle | "none" | null;
  hinge?: "left" | "right" | "top" | "bottom" | null;
}

/** A front's rectangle, drawn in the elevation of its run: used exactly as it is. */
export interface PromptsFileFrontOutput {
  corners_m: number[][];
  handle: PromptsFileHandle | "none" | null;
  hinge: "left" | "right" | "top" | "bottom" | null;
}

/** Where a front's handle is: to the right and up from the front's centre. */
export interface PromptsFileHandle {
  left_m: number;
  bottom_m: number;
  right_m: number;
  top_m: number;
}

/** A mask of a whole frame by run lengths. */
export interface PromptsFileMask {
  width: number;
  height: number;
  runs: number[];
}

/** One object of prompts.json. */
export interface PromptsFileObjectInput {
  name: string;
  category: string;
  points: PromptsFilePoint[];
  front?: PromptsFileFrontInput | null;
  frames?: PromptsFileFrame[];
  crop?: PromptsFileCrop | null;
}

/** One object of prompts.json. */
export interface PromptsFileObjectOutput {
  name: string;
  category: string;
  points: PromptsFilePoint[];
  front: PromptsFileFrontOutput | null;
  frames: PromptsFileFrame[];
  crop: PromptsFileCrop | null;
}

/** One click of prompts.json. */
export interface PromptsFilePoint {
  frame: number;
  x: number;
  y: number;
  label: 0 | 1;
}

/** An object proposed without a click; confirming it adds this click under this category. */
export interface Proposal {
  id: string;
  kind: "front" | "appliance" | "thing";
  category: string;
  confidence: number;
  frame: number;
  x: number;
  y: number;
  size_m: number[];
  outline: [number, number][];
  handle: [number, number][];
  doubts: string[];
}

/** Selection of proposals. */
export interface ProposalIds {
  ids: string[];
}

/** The current proposals, without dismissed and confirmed ones. */
export interface Proposals {
  state: "none" | "running" | "done";
  fraction: number;
  items: Proposal[];
  dismissed: number;
}

/** Proposals to be confirmed as objects. */
export interface ProposalsConfirmed {
  ids: string[];
  category?: string | null;
}

/** Options for reading the recording. */
export interface ReadingIn {
  register_depth?: boolean | null;
  scale?: number | null;
}

/** The recording for a project without one: a complete upload. */
export interface RecordingIn {
  upload: string;
}

/** One permitted step; with unmet conditions it needs a written reason, which is stored in the history. */
export interface ReviewMove {
  to: "draft" | "ready" | "in review" | "changes requested" | "approved";
  text: string;
  role: "annotator" | "reviewer";
  unmet: string[];
  notes: string[];
  needs_reason: boolean;
}

/** The review state with its author, and the possible next steps. */
export interface ReviewStatus {
  state: "draft" | "ready" | "in review" | "changes requested" | "approved";
  who: string;
  at: number | null;
  reason: string;
  moves: ReviewMove[];
}

/** A requested step; refused if the project is no longer in `from_state`. */
export interface ReviewStep {
  from_state: "draft" | "ready" | "in review" | "changes requested" | "approved";
  to: "draft" | "ready" | "in review" | "changes requested" | "approved";
  reason?: string;
}

/** The object after a verdict or a correction, and the resulting job. */
export interface Reviewed {
  group: CandidateGroup | null;
  job: Job | null;
  text: string;
}

/** Result of a gripper or an arm at one joint or free-standing object. */
export interface RobotGrip {
  kind: string;
  name: string;
  method: string | null;
  passed: boolean;
  grip_n: number | null;
  opened: number | null;
  why: string;
  picture: string | null;
}

/** One robot's trial in a bundle. */
export interface RobotTrial {
  name: string;
  joints: number;
  joints_opened: number;
  grips: RobotGrip[];
  places: StandingPlace[];
  map: string | null;
  why: string | null;
}

/** A run's backends, where they differ from the defaults. */
export interface RunRequest {
  segmenter?: string | null;
  generator?: string | null;
  matcher?: string | null;
  arm?: string | null;
  seed?: number;
}

/** A synthetic kitchen. */
export interface SampleRequest {
  seed?: number;
  frames?: number;
  width?: number;
  height?: number;
  name?: string | null;
}

/** One object of the finished scene. */
export interface SceneItem {
  object: number | null;
  name: string;
  run_name: string;
  category: string;
  fixture: string;
  dimensions_m: number[];
  dimension_sources: string[];
  joints: SceneJoint[];
  movable: boolean;
  carried_by: string | null;
  mask_frames: number;
  placement_rms_m: number | null;
  warp_residual_m: number | null;
  warnings: string[];
  colour: number[];
  override: OverrideData;
  changed: boolean;
}

/** One joint; 0 is closed, positive opens. Angles in radians, lengths in metres. */
export interface SceneJoint {
  name: string;
  type: "revolute" | "prismatic";
  axis: number[];
  origin: number[];
  lower: number;
  upper: number;
  sources: Record<string, string>;
  handle: number[] | null;
}

/** One annotated object. */
export interface SceneObject {
  id: number;
  project: string;
  name: string;
  category: string;
  colour: number;
  version: number;
  deleted: boolean;
  points: Point[];
  front: PromptsFileFrontOutput | null;
  frames: FrameSaid[];
  crop: PromptsFileCrop | null;
  assignee: string | null;
  locked_by: string | null;
  can_undo: boolean;
  can_redo: boolean;
  segment: "none" | "waiting" | "running" | "partial" | "done" | "failed";
  mask_frames: number;
  mask_backend: string;
  notices: string[];
  doubts: string[];
  certainty: number | null;
  suggested: string;
  saved: number;
}

/** The finished scene as a table. */
export interface SceneSummary {
  items: SceneItem[];
  left_out: LeftOut[];
  unused: LeftOut[];
  failures: Record<string, string>;
  warnings: string[];
  stages: StageInfo[];
  glb: string | null;
  preview: string | null;
}

/** One running process that takes jobs. */
export interface Seat {
  id: number;
  host: string;
  process: number;
  here: boolean;
  version: string;
  jobs_at_a_time: number;
  began: number;
  silent_s: number;
  draining: boolean;
  jobs: SeatJob[];
}

/** A requested change of a seat. */
export interface SeatIn {
  draining: boolean;
}

/** A job that runs at a seat. */
export interface SeatJob {
  id: number;
  project_id: string;
  project_name: string;
  kind: string;
  stage: string;
  progress: number;
  objects: string[];
}

/** All seats, and the number of waiting jobs. */
export interface Seats {
  waiting: number;
  shared: boolean;
  seats: Seat[];
}

/** The last event that was read. */
export interface SeenIn {
  event: number;
}

/** Loading code of a bundle for one simulator. */
export interface SimulatorLines {
  simulator: string;
  install: string;
  language: string;
  code: string;
  note: string;
  loader: string | null;
}

/** Backend and duration of one stage. */
export interface StageInfo {
  name: string;
  backend: string;
  seconds: number | null;
}

/** One stage of a job. */
export interface StageState {
  name: string;
  state: "waiting" | "running" | "done" | "failed" | "cancelled";
}

/** Base position of an arm, and the joints that it operates from there. */
export interface StandingPlace {
  x_m: number;
  y_m: number;
  lift_m: number;
  joints: string[];
}

/** Capabilities of the app; limits are shown before a file is chosen. */
export interface SystemInfo {
  version: string;
  user: string;
  role: "annotator" | "reviewer" | "admin";
  account: boolean;
  sign_out: string | null;
  max_upload_bytes: number;
  free_bytes: number;
  import_roots: string[];
  categories: Category[];
  palette: string[];
  viewer: boolean;
  segmenters: Backend[];
  generators: Backend[];
  matchers: Backend[];
  arms: Backend[];
  formats: BundleFormat[];
}

/** A stored template. */
export interface Template {
  id: number;
  name: string;
  objects: ListedObject[];
  who: string;
  changed: number;
  may_change: boolean;
}

/** Content of a template; names are unique, as in a project. */
export interface TemplateIn {
  name: string;
  objects: ListedObject[];
}

/** Rest test of one free-standing object. */
export interface ThingVerdict {
  name: string;
  drift_m: number | null;
  opening_free: number | null;
}

/** A project in the trash. */
export interface Trashed {
  id: string;
  name: string;
  at: number;
  who: string;
  size_bytes: number;
  counts: ProjectCounts;
}

/** A length measured in the room, beside the length in the scan. */
export interface TrueLength {
  id: number;
  text: string;
  object: number | null;
  side: "width" | "depth" | "height" | null;
  points_world: number[][] | null;
  metres: number;
  measured_m: number | null;
  error_m: number | null;
  compared: boolean;
  who: string;
  at: number;
}

/** A length measured with a tape: of an object's side in the finished scene, or between two points of the world. */
export interface TrueLengthIn {
  metres: number;
  object?: number | null;
  side?: "width" | "depth" | "height" | null;
  points_world?: number[][] | null;
  text?: string;
}

/** All true lengths of a project, and the scale that fits them best. */
export interface TrueLengths {
  lengths: TrueLength[];
  scale: number;
  scale_wanted: number | null;
  mean_error: number | null;
  mean_error_scaled: number | null;
}

/** A ground-truth object, and the user's object matched to it, if any. */
export interface TrueObject {
  name: string;
  category: string;
  object: number | null;
  iou: number | null;
  same_category: boolean | null;
}

/** Target of an undo or redo: the last change of this object, or this person's last one of any object when None. */
export interface UndoRequest {
  object?: number | null;
  scope?: "prompts" | "review";
  version?: number | null;
}

/** The undone or redone change, for display. */
export interface Undone {
  object: SceneObject;
  text: string;
  frame: number | null;
  version: number;
}

/** One file or folder that was set aside, and its content. */
export interface UnknownFolder {
  entry: string;
  kind: "project" | "newer" | "upload" | "other";
  name: string;
  path: string;
  size_bytes: number;
  changed: number | null;
  objects: number;
  clicks: number;
  bundles: number;
  recording: boolean;
  why_not: string;
  left: boolean;
}

/** An unfinished upload of a recording; the next bytes start at `offset`. */
export interface Upload {
  id: string;
  file_name: string;
  size: number;
  modified: number | null;
  offset: number;
  created: number;
}

/** Announcement of a file by its sender. */
export interface UploadIn {
  file_name: string;
  size: number;
  name?: string | null;
  modified?: number | null;
}

/** Variants made together by one job. */
export interface VariantSet {
  name: string;
  version: number;
  count: number;
  seed: number;
  url: string;
  file_name: string;
  wall: string;
  sha256: string;
  size: number;
  created: number;
  rejected: Record<string, number>;
  checked: number;
  failed: string[];
}

/** All variants of a project's bundles, and the estimated size of further ones. */
export interface Variants {
  offer: VariantsOffer | null;
  sets: VariantSet[];
}

/** Request for variants. */
export interface VariantsIn {
  version: number;
  count: number;
  seed?: number;
}

/** Estimated size of variants of the newest bundle. */
export interface VariantsOffer {
  version: number;
  most: number;
  zip_bytes: number;
  each_zip_bytes: number;
  disk_bytes: number;
  each_disk_bytes: number;
  free_bytes: number;
}

/** A reviewer's verdict. Rejecting the last one makes new candidates; accepting another one aligns it again. */
export interface VerdictIn {
  candidate: string;
  verdict: "accepted" | "rejected" | "cleared";
  reason?: string;
  rerun?: boolean;
  version?: number | null;
}

/** The box of an object to be moved by hand. */
export interface ViewerBox {
  pose: number[][];
  size: [number, number, number];
}

/** Position and target of a camera of the 3D view, in the world. */
export interface ViewerCamera {
  position: [number, number, number];
  target: [number, number, number];
}

/** A clip box, as fractions of the scene's width, depth (from its fronts) and height. */
export interface ViewerClip {
  low: [number, number, number];
  high: [number, number, number];
}

/** One joint of the scene the 3D view shows. */
export interface ViewerJoint {
  name: string;
  lower: number;
  upper: number;
  value: number;
}

/** Display settings and camera of the 3D view, as stored with a comment. */
export interface ViewerLookInput {
  mode: "cloud" | "candidate" | "aligned" | "scene";
  draw?: "meshes" | "wireframe" | "colliders" | "both" | "distance" | "unobserved";
  cloud?: boolean;
  opacity?: number;
  hidden?: string[];
  parallel?: boolean;
  clip?: ViewerClip | null;
  camera?: ViewerCamera | null;
}

/** Display settings and camera of the 3D view, as stored with a comment. */
export interface ViewerLookOutput {
  mode: "cloud" | "candidate" | "aligned" | "scene";
  draw: "meshes" | "wireframe" | "colliders" | "both" | "distance" | "unobserved";
  cloud: boolean;
  opacity: number;
  hidden: string[];
  parallel: boolean;
  clip: ViewerClip | null;
  camera: ViewerCamera | null;
}

/** The object or point of the last click in the 3D view. */
export interface ViewerPicked {
  number: number;
  name: string;
  object: number | null;
  point: number[] | null;
}

/** New pose of the object being moved by hand, world_from_object; null leaves it unchanged. */
export interface ViewerPlace {
  pose: number[][] | null;
}

/** Pose of the object being moved by hand, world_from_object; null without one. */
export interface ViewerPlaced {
  pose: number[][] | null;
}

/** Address of a project's 3D view; the fallbacks when it is down. */
export interface ViewerSession {
  state: "ready" | "down";
  url: string | null;
  message: string;
  fallback_page: string | null;
  fallback_image: string | null;
}

/** The requested content of the 3D view. */
export interface ViewerShow {
  mode: "cloud" | "candidate" | "aligned" | "scene";
  draw?: "meshes" | "wireframe" | "colliders" | "both" | "distance" | "unobserved";
  cloud?: boolean;
  opacity?: number;
  hidden?: string[];
  parallel?: boolean;
  clip?: ViewerClip | null;
  camera?: ViewerCamera | null;
  object?: number | null;
  made?: string | null;
  candidate?: string | null;
  tape?: number[][];
  box?: ViewerBox | null;
  full?: boolean;
  look?: "object" | "scene" | "front" | "back" | "left" | "right" | "top" | "bottom" | "run" | "photo" | null;
  frame?: number | null;
}

/** The current content of the 3D view. */
export interface ViewerShown {
  mode: string;
  text: string;
  reduced: boolean;
  joints: ViewerJoint[];
  preview: string[];
  span_m: [number, number, number] | null;
  part: ViewerClip | null;
}

/** A webhook with its address, project and last attempt. */
export interface Webhook {
  id: number;
  url: string;
  project: string | null;
  project_name: string;
  owner: string;
  created: number;
  answer: string;
  delivered: number | null;
}

/** A new webhook, of a project of yours, or, for admins, of every project. */
export interface WebhookIn {
  url: string;
  project?: string | null;
}

/** Every endpoint by its name. */
export interface Operations {
  /** POST /api/account/password */
  changePassword: { parameters: Record<string, never>; body: PasswordChange; answer: unknown };
  /** GET /api/accounts */
  listAccounts: { parameters: Record<string, never>; body: undefined; answer: AccountInfo[] };
  /** POST /api/accounts */
  addAccount: { parameters: Record<string, never>; body: AccountIn; answer: AccountInfo };
  /** DELETE /api/accounts/{name} */
  removeAccount: { parameters: { name: string }; body: undefined; answer: unknown };
  /** PATCH /api/accounts/{name} */
  changeAccount: { parameters: { name: string }; body: AccountPatch; answer: AccountInfo };
  /** GET /api/audit */
  listAudit: { parameters: { before?: number | null; limit?: number }; body: undefined; answer: AuditPage };
  /** GET /api/browse */
  browse: { parameters: { path?: string | null }; body: undefined; answer: FolderListing };
  /** GET /api/health */
  health: { parameters: Record<string, never>; body: undefined; answer: Record<string, string> };
  /** GET /api/honeypots */
  listHoneypots: { parameters: Record<string, never>; body: undefined; answer: Honeypot[] };
  /** GET /api/inbox */
  getInbox: { parameters: Record<string, never>; body: undefined; answer: Inbox };
  /** GET /api/jobs */
  listJobs: { parameters: { project?: string | null; limit?: number }; body: undefined; answer: Job[] };
  /** GET /api/jobs/{job} */
  getJob: { parameters: { job: number }; body: undefined; answer: Job };
  /** POST /api/jobs/{job}/cancel */
  cancelJob: { parameters: { job: number }; body: undefined; answer: Job };
  /** GET /api/jobs/{job}/events */
  getJobEvents: { parameters: { job: number; after?: number }; body: undefined; answer: JobEvent[] };
  /** GET /api/jobs/{job}/log */
  getJobLog: { parameters: { job: number; tail?: number }; body: undefined; answer: unknown };
  /** POST /api/jobs/{job}/retry */
  retryJob: { parameters: { job: number }; body: undefined; answer: Job };
  /** POST /api/login */
  signIn: { parameters: Record<string, never>; body: Credentials; answer: unknown };
  /** POST /api/logout */
  signOut: { parameters: Record<string, never>; body: undefined; answer: unknown };
  /** GET /api/projects */
  listProjects: { parameters: Record<string, never>; body: undefined; answer: ProjectSummary[] };
  /** POST /api/projects/import */
  importProject: { parameters: Record<string, never>; body: ImportPath; answer: Project };
  /** POST /api/projects/sample */
  sampleProject: { parameters: Record<string, never>; body: SampleRequest; answer: Project };
  /** POST /api/projects/upload */
  uploadProject: { parameters: { filename: string; name?: string | null }; body: undefined; answer: Project };
  /** DELETE /api/projects/{project} */
  deleteProject: { parameters: { project: string }; body: undefined; answer: Trashed };
  /** GET /api/projects/{project} */
  getProject: { parameters: { project: string }; body: undefined; answer: Project };
  /** PATCH /api/projects/{project} */
  changeProject: { parameters: { project: string }; body: ProjectPatch; answer: Project };
  /** PUT /api/projects/{project}/assignee */
  assignProject: { parameters: { project: string }; body: AssigneeIn; answer: Project };
  /** GET /api/projects/{project}/bundles */
  listBundles: { parameters: { project: string }; body: undefined; answer: Bundle[] };
  /** GET /api/projects/{project}/bundles/{version}/changes */
  compareBundles: { parameters: { project: string; version: number; since: number }; body: undefined; answer: BundleChange[] };
  /** GET /api/projects/{project}/bundles/{version}/check */
  checkBundle: { parameters: { project: string; version: number }; body: undefined; answer: BundleCheck };
  /** GET /api/projects/{project}/bundles/{version}/inside */
  bundleInside: { parameters: { project: string; version: number }; body: undefined; answer: BundleInside };
  /** GET /api/projects/{project}/candidates */
  listCandidates: { parameters: { project: string }; body: undefined; answer: CandidateGroup[] };
  /** GET /api/projects/{project}/certificate */
  getCertificate: { parameters: { project: string }; body: undefined; answer: Certificate };
  /** PUT /api/projects/{project}/checklist */
  setChecklist: { parameters: { project: string }; body: ChecklistIn; answer: Project };
  /** GET /api/projects/{project}/comments */
  listComments: { parameters: { project: string }; body: undefined; answer: Comment[] };
  /** POST /api/projects/{project}/comments */
  addComment: { parameters: { project: string }; body: CommentIn; answer: Comment };
  /** PATCH /api/projects/{project}/comments/{comment} */
  changeComment: { parameters: { project: string; comment: number }; body: CommentPatch; answer: Comment };
  /** POST /api/projects/{project}/duplicate */
  duplicateProject: { parameters: { project: string }; body: undefined; answer: Project };
  /** GET /api/projects/{project}/effort.csv */
  getEffort: { parameters: { project: string }; body: undefined; answer: unknown };
  /** GET /api/projects/{project}/elevations */
  getElevations: { parameters: { project: string }; body: undefined; answer: Elevations };
  /** GET /api/projects/{project}/elevations/fronts */
  getFoundFronts: { parameters: { project: string }; body: undefined; answer: FoundFront[] };
  /** GET /api/projects/{project}/figures */
  getFigures: { parameters: { project: string }; body: undefined; answer: Figures };
  /** GET /api/projects/{project}/file */
  offerProjectFile: { parameters: { project: string }; body: undefined; answer: ProjectFileOffer };
  /** GET /api/projects/{project}/frames */
  listFrames: { parameters: { project: string }; body: undefined; answer: FrameInfo[] };
  /** GET /api/projects/{project}/frames/{frame}/camera */
  getCamera: { parameters: { project: string; frame: number }; body: undefined; answer: FrameCamera };
  /** GET /api/projects/{project}/history */
  getHistory: { parameters: { project: string; object?: number | null; before?: number | null; limit?: number }; body: undefined; answer: HistoryEntry[] };
  /** GET /api/projects/{project}/honeypot */
  scoreHoneypot: { parameters: { project: string }; body: undefined; answer: HoneypotScore };
  /** POST /api/projects/{project}/honeypot */
  slipHoneypot: { parameters: { project: string }; body: HoneypotIn; answer: Honeypot };
  /** GET /api/projects/{project}/lanes */
  getLanes: { parameters: { project: string }; body: undefined; answer: Lane[] };
  /** GET /api/projects/{project}/lengths */
  listLengths: { parameters: { project: string }; body: undefined; answer: TrueLengths };
  /** POST /api/projects/{project}/lengths */
  addLength: { parameters: { project: string }; body: TrueLengthIn; answer: TrueLengths };
  /** DELETE /api/projects/{project}/lengths/{length} */
  removeLength: { parameters: { project: string; length: number }; body: undefined; answer: TrueLengths };
  /** GET /api/projects/{project}/live */
  getLive: { parameters: { project: string }; body: undefined; answer: LiveStatus };
  /** POST /api/projects/{project}/live/open */
  openLive: { parameters: { project: string }; body: undefined; answer: LiveStatus };
  /** GET /api/projects/{project}/masks/{frame} */
  getMasks: { parameters: { project: string; frame: number }; body: undefined; answer: FrameMask[] };
  /** GET /api/projects/{project}/members */
  getMembers: { parameters: { project: string }; body: undefined; answer: ProjectMembers };
  /** PUT /api/projects/{project}/members */
  setMembers: { parameters: { project: string }; body: MembersIn; answer: ProjectMembers };
  /** GET /api/projects/{project}/news */
  getNews: { parameters: { project: string }; body: undefined; answer: News };
  /** PUT /api/projects/{project}/news */
  markSeen: { parameters: { project: string }; body: SeenIn; answer: News };
  /** GET /api/projects/{project}/objects */
  listObjects: { parameters: { project: string; deleted?: boolean }; body: undefined; answer: SceneObject[] };
  /** POST /api/projects/{project}/objects */
  createObject: { parameters: { project: string; infer?: boolean }; body: ObjectIn; answer: SceneObject };
  /** DELETE /api/projects/{project}/objects/{object} */
  deleteObject: { parameters: { project: string; object: number }; body: undefined; answer: SceneObject };
  /** PATCH /api/projects/{project}/objects/{object} */
  editObject: { parameters: { project: string; object: number }; body: ObjectPatch; answer: SceneObject };
  /** GET /api/projects/{project}/objects/{object}/candidates */
  getCandidates: { parameters: { project: string; object: number }; body: undefined; answer: CandidateGroup };
  /** POST /api/projects/{project}/objects/{object}/candidates */
  uploadCandidate: { parameters: { project: string; object: number; filename: string; rerun?: boolean; version?: number | null }; body: undefined; answer: Reviewed };
  /** POST /api/projects/{project}/objects/{object}/clicks */
  addPoints: { parameters: { project: string; object: number; infer?: boolean }; body: PointsIn; answer: SceneObject };
  /** GET /api/projects/{project}/objects/{object}/cloud */
  getObjectPoints: { parameters: { project: string; object: number }; body: undefined; answer: ObjectPoints };
  /** GET /api/projects/{project}/objects/{object}/differences */
  getDifferences: { parameters: { project: string; object: number; against: string }; body: undefined; answer: Differences };
  /** DELETE /api/projects/{project}/objects/{object}/frames/{frame} */
  leaveFrame: { parameters: { project: string; object: number; frame: number }; body: undefined; answer: SceneObject };
  /** PUT /api/projects/{project}/objects/{object}/frames/{frame} */
  setFrame: { parameters: { project: string; object: number; frame: number }; body: FrameIn; answer: SceneObject };
  /** POST /api/projects/{project}/objects/{object}/mesh-look */
  lookAtMesh: { parameters: { project: string; object: number; filename: string }; body: undefined; answer: MeshLook };
  /** GET /api/projects/{project}/objects/{object}/override */
  getOverride: { parameters: { project: string; object: number }; body: undefined; answer: OverrideData };
  /** PATCH /api/projects/{project}/objects/{object}/override */
  setOverride: { parameters: { project: string; object: number }; body: OverridePatch; answer: Reviewed };
  /** GET /api/projects/{project}/objects/{object}/photos */
  getPhotos: { parameters: { project: string; object: number }; body: undefined; answer: ObjectPhotos };
  /** POST /api/projects/{project}/objects/{object}/points */
  addPoint: { parameters: { project: string; object: number; infer?: boolean }; body: PointIn; answer: SceneObject };
  /** DELETE /api/projects/{project}/objects/{object}/points/{point} */
  deletePoint: { parameters: { project: string; object: number; point: number; infer?: boolean }; body: undefined; answer: SceneObject };
  /** PATCH /api/projects/{project}/objects/{object}/points/{point} */
  movePoint: { parameters: { project: string; object: number; point: number; infer?: boolean }; body: PointPatch; answer: SceneObject };
  /** POST /api/projects/{project}/objects/{object}/segment */
  segmentObject: { parameters: { project: string; object: number }; body: undefined; answer: SceneObject };
  /** POST /api/projects/{project}/objects/{object}/segment/cancel */
  cancelSegment: { parameters: { project: string; object: number }; body: undefined; answer: SceneObject };
  /** POST /api/projects/{project}/objects/{object}/verdicts */
  giveVerdict: { parameters: { project: string; object: number }; body: VerdictIn; answer: Reviewed };
  /** GET /api/projects/{project}/openings */
  getOpenings: { parameters: { project: string }; body: undefined; answer: Opening[] };
  /** GET /api/projects/{project}/opinions */
  listOpinions: { parameters: { project: string }; body: undefined; answer: Opinion[] };
  /** POST /api/projects/{project}/opinions */
  askOpinion: { parameters: { project: string }; body: OpinionIn; answer: Project };
  /** GET /api/projects/{project}/opinions/{other} */
  getAgreement: { parameters: { project: string; other: string }; body: undefined; answer: Agreement };
  /** GET /api/projects/{project}/opinions/{other}/agreement.csv */
  getAgreementTable: { parameters: { project: string; other: string }; body: undefined; answer: unknown };
  /** GET /api/projects/{project}/people */
  listNames: { parameters: { project: string }; body: undefined; answer: string[] };
  /** GET /api/projects/{project}/prompts.json */
  exportPrompts: { parameters: { project: string }; body: undefined; answer: PromptsFileOutput };
  /** POST /api/projects/{project}/prompts.json */
  importPrompts: { parameters: { project: string }; body: PromptsFileInput; answer: SceneObject[] };
  /** GET /api/projects/{project}/proposals */
  getProposals: { parameters: { project: string }; body: undefined; answer: Proposals };
  /** POST /api/projects/{project}/proposals/confirm */
  confirmProposals: { parameters: { project: string }; body: ProposalsConfirmed; answer: SceneObject[] };
  /** POST /api/projects/{project}/proposals/dismiss */
  dismissProposals: { parameters: { project: string }; body: ProposalIds; answer: Proposals };
  /** POST /api/projects/{project}/proposals/restore */
  restoreProposals: { parameters: { project: string }; body: undefined; answer: Proposals };
  /** PUT /api/projects/{project}/reading */
  readAgain: { parameters: { project: string }; body: ReadingIn; answer: Project };
  /** PUT /api/projects/{project}/recording */
  giveRecording: { parameters: { project: string }; body: RecordingIn; answer: Project };
  /** POST /api/projects/{project}/redo */
  redo: { parameters: { project: string }; body: UndoRequest; answer: Undone };
  /** GET /api/projects/{project}/review */
  getReview: { parameters: { project: string }; body: undefined; answer: ReviewStatus };
  /** POST /api/projects/{project}/review */
  stepReview: { parameters: { project: string }; body: ReviewStep; answer: ReviewStatus };
  /** POST /api/projects/{project}/run */
  runProject: { parameters: { project: string }; body: RunRequest; answer: Job };
  /** GET /api/projects/{project}/scene */
  getScene: { parameters: { project: string }; body: undefined; answer: SceneSummary };
  /** PATCH /api/projects/{project}/scene/{name}/override */
  correctMade: { parameters: { project: string; name: string }; body: OverridePatch; answer: Reviewed };
  /** POST /api/projects/{project}/undo */
  undo: { parameters: { project: string }; body: UndoRequest; answer: Undone };
  /** GET /api/projects/{project}/variants */
  listVariants: { parameters: { project: string }; body: undefined; answer: Variants };
  /** POST /api/projects/{project}/variants */
  makeVariants: { parameters: { project: string }; body: VariantsIn; answer: Job };
  /** DELETE /api/projects/{project}/variants/{variants_name} */
  deleteVariants: { parameters: { project: string; variants_name: string }; body: undefined; answer: Variants };
  /** POST /api/projects/{project}/viewer */
  openViewer: { parameters: { project: string }; body: undefined; answer: ViewerSession };
  /** GET /api/projects/{project}/viewer/camera */
  getViewerCamera: { parameters: { project: string }; body: undefined; answer: ViewerCamera };
  /** POST /api/projects/{project}/viewer/joints */
  setJoints: { parameters: { project: string }; body: JointValues; answer: ViewerShown };
  /** GET /api/projects/{project}/viewer/picked */
  getPicked: { parameters: { project: string }; body: undefined; answer: ViewerPicked };
  /** POST /api/projects/{project}/viewer/place */
  placeInViewer: { parameters: { project: string }; body: ViewerPlace; answer: ViewerPlaced };
  /** POST /api/projects/{project}/viewer/show */
  showInViewer: { parameters: { project: string }; body: ViewerShow; answer: ViewerShown };
  /** GET /api/seats */
  listSeats: { parameters: Record<string, never>; body: undefined; answer: Seats };
  /** PATCH /api/seats/{seat} */
  drainSeat: { parameters: { seat: number }; body: SeatIn; answer: Seats };
  /** GET /api/system */
  getSystem: { parameters: Record<string, never>; body: undefined; answer: SystemInfo };
  /** GET /api/templates */
  listTemplates: { parameters: Record<string, never>; body: undefined; answer: Template[] };
  /** POST /api/templates */
  addTemplate: { parameters: Record<string, never>; body: TemplateIn; answer: Template };
  /** DELETE /api/templates/{template} */
  removeTemplate: { parameters: { template: number }; body: undefined; answer: unknown };
  /** PUT /api/templates/{template} */
  changeTemplate: { parameters: { template: number }; body: TemplateIn; answer: Template };
  /** GET /api/tokens */
  listTokens: { parameters: Record<string, never>; body: undefined; answer: ApiToken[] };
  /** POST /api/tokens */
  addToken: { parameters: Record<string, never>; body: ApiTokenIn; answer: NewApiToken };
  /** DELETE /api/tokens/{token} */
  revokeToken: { parameters: { token: number }; body: undefined; answer: unknown };
  /** GET /api/trash */
  listTrash: { parameters: Record<string, never>; body: undefined; answer: Trashed[] };
  /** DELETE /api/trash/{entry} */
  deleteForGood: { parameters: { entry: string }; body: undefined; answer: Deleted };
  /** POST /api/trash/{entry}/restore */
  restoreProject: { parameters: { entry: string }; body: undefined; answer: Project };
  /** GET /api/unknown */
  listUnknown: { parameters: Record<string, never>; body: undefined; answer: UnknownFolder[] };
  /** POST /api/unknown/{entry}/adopt */
  adoptUnknown: { parameters: { entry: string }; body: undefined; answer: Project };
  /** POST /api/unknown/{entry}/discard */
  discardUnknown: { parameters: { entry: string }; body: undefined; answer: unknown };
  /** POST /api/unknown/{entry}/leave */
  leaveUnknown: { parameters: { entry: string }; body: undefined; answer: UnknownFolder };
  /** GET /api/uploads */
  listUploads: { parameters: Record<string, never>; body: undefined; answer: Upload[] };
  /** POST /api/uploads */
  beginUpload: { parameters: Record<string, never>; body: UploadIn; answer: Upload };
  /** DELETE /api/uploads/{upload} */
  cancelUpload: { parameters: { upload: string }; body: undefined; answer: unknown };
  /** HEAD /api/uploads/{upload} */
  uploadOffset: { parameters: { upload: string }; body: undefined; answer: unknown };
  /** PATCH /api/uploads/{upload} */
  continueUpload: { parameters: { upload: string }; body: undefined; answer: unknown };
  /** POST /api/uploads/{upload}/finish */
  finishUpload: { parameters: { upload: string }; body: undefined; answer: Project };
  /** GET /api/webhooks */
  listWebhooks: { parameters: Record<string, never>; body: undefined; answer: Webhook[] };
  /** POST /api/webhooks */
  addWebhook: { parameters: Record<string, never>; body: WebhookIn; answer: NewWebhook };
  /** DELETE /api/webhooks/{webhook} */
  removeWebhook: { parameters: { webhook: number }; body: undefined; answer: unknown };
  /** GET /api/webhooks/{webhook}/deliveries */
  listDeliveries: { parameters: { webhook: number }; body: undefined; answer: Delivery[] };
  /** POST /api/webhooks/{webhook}/test */
  testWebhook: { parameters: { webhook: number }; body: undefined; answer: Delivery };
  /** GET /media/{project}/README.txt */
  sceneReadme: { parameters: { project: string }; body: undefined; answer: unknown };
  /** GET /media/{project}/arriving.jpg */
  arrivingPicture: { parameters: { project: string; v?: string }; body: undefined; answer: unknown };
  /** GET /media/{project}/bundles/{version}.zip */
  downloadBundle: { parameters: { project: string; version: number; formats?: string[] }; body: undefined; answer: unknown };
  /** GET /media/{project}/bundles/{version}/objects/{object_name}.zip */
  downloadObject: { parameters: { project: string; version: number; object_name: string }; body: undefined; answer: unknown };
  /** GET /media/{project}/bundles/{version}/pictures/{folder}/{picture} */
  bundlePicture: { parameters: { project: string; version: number; folder: "gripper" | "arm"; picture: string }; body: undefined; answer: unknown };
  /** GET /media/{project}/candidates/{object}/{candidate}.glb */
  candidateMesh: { parameters: { project: string; object: number; candidate: string; v?: string }; body: undefined; answer: unknown };
  /** GET /media/{project}/candidates/{object}/{candidate}.png */
  candidatePicture: { parameters: { project: string; object: number; candidate: string; v?: string }; body: undefined; answer: unknown };
  /** GET /media/{project}/candidates/{object}/{candidate}/turns.png */
  candidateTurns: { parameters: { project: string; object: number; candidate: string; against?: string; v?: string }; body: undefined; answer: unknown };
  /** GET /media/{project}/depth/{frame}.png */
  depthImage: { parameters: { project: string; frame: number; v?: string }; body: undefined; answer: unknown };
  /** GET /media/{project}/elevations/{elevation}.png */
  elevationPicture: { parameters: { project: string; elevation: number; v?: string }; body: undefined; answer: unknown };
  /** GET /media/{project}/frames/{frame}.jpg */
  frameImage: { parameters: { project: string; frame: number; w?: number | null; v?: string }; body: undefined; answer: unknown };
  /** GET /media/{project}/overlay/{object}/{frame}.png */
  overlayPicture: { parameters: { project: string; object: number; frame: number; of?: "placed" | "primitive" | "fitted"; look?: "ghost" | "outline" | "residual"; v?: string }; body: undefined; answer: unknown };
  /** GET /media/{project}/preview.png */
  scenePicture: { parameters: { project: string; v?: string }; body: undefined; answer: unknown };
  /** GET /media/{project}/project.zip */
  downloadProject: { parameters: { project: string; recording?: boolean }; body: undefined; answer: unknown };
  /** GET /media/{project}/report.html */
  sceneReport: { parameters: { project: string }; body: undefined; answer: unknown };
  /** GET /media/{project}/review.html */
  sceneReview: { parameters: { project: string; v?: string }; body: undefined; answer: unknown };
  /** GET /media/{project}/scan/{side}.png */
  scanPicture: { parameters: { project: string; side: "plan" | "view"; v?: string }; body: undefined; answer: unknown };
  /** GET /media/{project}/scene.glb */
  sceneMesh: { parameters: { project: string; v?: string }; body: undefined; answer: unknown };
  /** GET /media/{project}/thumbnail.jpg */
  thumbnail: { parameters: { project: string; v?: string }; body: undefined; answer: unknown };
  /** GET /media/{project}/variants/{variants_name}.jpg */
  variantsWall: { parameters: { project: string; variants_name: string; v?: string }; body: undefined; answer: unknown };
  /** GET /media/{project}/variants/{variants_name}.zip */
  downloadVariants: { parameters: { project: string; variants_name: string }; body: undefined; answer: unknown };
  /** GET /media/{project}/{folder}/{picture} */
  reportPicture: { parameters: { project: string; folder: "pictures" | "gripper" | "arm"; picture: string }; body: undefined; answer: unknown };
}
