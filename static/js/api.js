/** One function per endpoint. Failures are ApiError(status, {kind, message, hint}). */

/** @import {
 *   SystemInfo, FolderListing, FrameCamera, Opening, Project, ProjectSummary, FrameInfo, SceneObject, Lane, Proposals, Elevations, FoundFront, FrameMask, LiveStatus, Job, JobEvent,
 *   CandidateGroup, Differences, MeshLook, Reviewed, SceneSummary, Certificate, Bundle, ObjectPoints, ReviewStatus, ReviewStep, Comment,
 *   Figures, ObjectPhotos, ViewerPicked, ViewerPlaced, ViewerSession, ViewerShown, ViewerShow, BundleChange, BundleCheck, BundleInside, RunRequest,
 *   HistoryEntry, Inbox, News, Deleted, Trashed, ErrorBody, SampleRequest, Upload, AccountInfo, AccountIn, AccountPatch, AuditPage,
 *   TrueLengthIn, TrueLengths, UnknownFolder, ProjectMembers, MembersIn, ReadingIn, Seats,
 *   ProjectFileOffer, Agreement, Variants, VariantsIn, Honeypot, HoneypotIn, HoneypotScore, Opinion, Template, TemplateIn, Webhook, WebhookIn, NewWebhook, Delivery
 * } from "./api-types" */

import { patiently } from "./lib/patience.js";
import { sendRest, stoppedUpload } from "./lib/resumable.js";

const OFFLINE = { kind: "offline", message: "the server cannot be reached", hint: "is r2c2r serve running?" };

export class ApiError extends Error {
  /**
   * @param {number} status 0 when the server could not be reached
   * @param {Omit<ErrorBody, "current"> & { current?: unknown }} body
   * @param {number | null} retryMs time until a retry, if the server sent Retry-After
   */
  constructor(status, body, retryMs = null) {
    super(body.message);
    this.status = status;
    this.kind = body.kind;
    this.hint = body.hint ?? "";
    this.current = body.current;
    this.retryMs = retryMs;
  }

  /** Whether the server could not be reached: no response, or only one of a proxy in front of it. */
  get unreachable() {
    return this.status === 0 || (this.kind === "internal" && [502, 503, 504].includes(this.status));
  }

  /** Whether a retry may succeed later: the server is unreachable, busy or full, or there were too many requests. */
  get later() {
    return this.unreachable || [429, 507].includes(this.status) || (this.kind === "environment" && this.status === 503);
  }
}

/**
 * @param {string} path
 * @param {{ method?: string, json?: unknown, body?: BodyInit, signal?: AbortSignal, headers?: Record<string, string> }} [options]
 */
async function call(path, { method = "GET", json, body, signal, headers: more = {} } = {}) {
  /** @type {Record<string, string>} */
  const headers = method === "GET" ? {} : { "X-Requested-With": "r2c2r", ...more };
  if (json !== undefined) headers["Content-Type"] = "application/json";
  else if (body !== undefined) headers["Content-Type"] = "application/octet-stream";
  /** @type {Response} */
  let response;
  try {
    response = await fetch(path, { method, headers, body: json === undefined ? body : JSON.stringify(json), signal });
  } catch (error) {
    if (error instanceof DOMException && error.name === "AbortError") throw error;
    throw new ApiError(0, OFFLINE);
  }
  if (response.status === 401 && path !== "/api/login")
    location.assign(`/login?${new URLSearchParams({ next: location.pathname + location.search })}`);
  const seconds = Number(response.headers.get("Retry-After"));
  if (!response.ok) throw new ApiError(response.status, await errorBody(response), seconds > 0 ? seconds * 1000 : null);
  return response;
}

/**
 * @param {Response} response
 * @returns {Promise<ConstructorParameters<typeof ApiError>[1]>}
 */
async function errorBody(response) {
  try {
    return await response.json();
  } catch {
    return { kind: "internal", message: `the server answered ${response.status}`, hint: "see its log" };
  }
}

/**
 * @param {string} path
 * @param {AbortSignal} [signal]
 */
const get = async (path, signal) => (await call(path, { signal })).json();
/**
 * @param {string} method
 * @param {string} path
 * @param {unknown} [json]
 */
const send = async (method, path, json = {}) => (await call(path, { method, json })).json();
/** @param {number} ms @returns {Promise<void>} */
const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
/**
 * Retry a request for heavy work until the server accepts it; a notice in the corner of the page shows the wait.
 * @template T
 * @param {() => Promise<T>} ask
 * @param {(error: ApiError) => void} [told]
 */
const takenOn = (ask, told = (error) => window.dispatchEvent(new CustomEvent("r2c2r-waits", { detail: error }))) =>
  patiently(ask, {
    retryMs: (error) => (error instanceof ApiError && error.status === 429 ? error.retryMs : null),
    told: (error) => told(/** @type {ApiError} */ (error)),
    wait,
  });
/** @param {string} id */
const of = (id) => `/api/projects/${encodeURIComponent(id)}`;

/**
 * Send a change; the server applies it once, however often it is sent with the same key, and only for the user who made it.
 * @param {string} method
 * @param {string} path
 * @param {Record<string, unknown>} json
 * @param {string} key
 * @param {string} person
 * @returns {Promise<unknown>}
 */
export const perform = async (method, path, json, key, person) => {
  const whose = { "Idempotency-Key": key, ...(person && { "X-R2C2R-Person": encodeURIComponent(person) }) };
  const response = await call(path, { method, json, headers: whose });
  return response.json().catch(() => {
    throw new ApiError(0, OFFLINE); // response cut off: to be requested again
  });
};

/** @param {string} name @param {string} password @param {(error: ApiError) => void} told called when it first has to wait */
export const signIn = (name, password, told) =>
  takenOn(() => call("/api/login", { method: "POST", json: { name, password } }), told);
export const signOut = () => call("/api/logout", { method: "POST", json: {} });
/** @param {string} old @param {string} now */
export const changePassword = (old, now) => call("/api/account/password", { method: "POST", json: { old, new: now } });
/** @returns {Promise<AccountInfo[]>} */
export const listAccounts = () => get("/api/accounts");
/** @param {number | null} before @returns {Promise<AuditPage>} */
export const listAudit = (before) =>
  get(`/api/audit?${new URLSearchParams(before === null ? {} : { before: String(before) })}`);
/** @param {AccountIn} account @returns {Promise<AccountInfo>} */
export const addAccount = (account) => send("POST", "/api/accounts", account);
/** @param {string} name @param {Partial<AccountPatch>} patch @returns {Promise<AccountInfo>} */
export const changeAccount = (name, patch) => send("PATCH", `/api/accounts/${encodeURIComponent(name)}`, patch);
/** @param {string} name */
export const removeAccount = (name) => call(`/api/accounts/${encodeURIComponent(name)}`, { method: "DELETE" });
/** @returns {Promise<SystemInfo>} */
export const getSystem = () => get("/api/system");
/** @param {string} path @returns {Promise<FolderListing>} */
export const browse = (path) => get(`/api/browse?${new URLSearchParams({ path })}`);

/** @param {AbortSignal} [signal] @returns {Promise<ProjectSummary[]>} */
export const listProjects = (signal) => get("/api/projects", signal);
/** @param {string} id @param {AbortSignal} [signal] @returns {Promise<Project>} */
export const getProject = (id, signal) => get(of(id), signal);
/** @param {string} path @returns {Promise<Project>} */
export const importPath = (path) => send("POST", "/api/projects/import", { path });
/** @param {Partial<SampleRequest>} request @returns {Promise<Project>} */
export const makeSample = (request) => send("POST", "/api/projects/sample", request);
/** @param {string} id @param {{ name?: string, segmenter?: string, tags?: string[], archived?: boolean }} patch @returns {Promise<Project>} */
export const changeProject = (id, patch) => send("PATCH", of(id), patch);
/** @param {string} id @param {ReadingIn} how @returns {Promise<Project>} */
export const readAgain = (id, how) => send("PUT", `${of(id)}/reading`, how);
/** Move a project to the trash. @param {string} id @returns {Promise<Trashed>} */
export const deleteProject = (id) => send("DELETE", of(id));
/** @param {string} id @returns {Promise<Project>} */
export const duplicateProject = (id) => send("POST", `${of(id)}/duplicate`);
/** @param {string} id @returns {Promise<ProjectFileOffer>} */
export const offerProjectFile = (id) => get(`${of(id)}/file`);
/** @param {AbortSignal} [signal] @returns {Promise<Trashed[]>} */
export const listTrash = (signal) => get("/api/trash", signal);
/** @param {string} id @returns {Promise<Project>} */
export const restoreProject = (id) => send("POST", `/api/trash/${encodeURIComponent(id)}/restore`);
/** @param {string} id @returns {Promise<Deleted>} */
export const deleteForGood = (id) => send("DELETE", `/api/trash/${encodeURIComponent(id)}`);
/** @param {AbortSignal} [signal] @returns {Promise<Seats>} */
export const listSeats = (signal) => get("/api/seats", signal);
/** @param {number} id @param {boolean} draining @returns {Promise<Seats>} */
export const drainSeat = (id, draining) => send("PATCH", `/api/seats/${id}`, { draining });
/** @param {AbortSignal} [signal] @returns {Promise<Webhook[]>} */
export const listWebhooks = (signal) => get("/api/webhooks", signal);
/** @param {WebhookIn} webhook @returns {Promise<NewWebhook>} */
export const addWebhook = (webhook) => send("POST", "/api/webhooks", webhook);
/** @param {number} id @returns {Promise<void>} */
export const removeWebhook = (id) => send("DELETE", `/api/webhooks/${id}`);
/** @param {number} id @returns {Promise<Delivery>} */
export const testWebhook = (id) => send("POST", `/api/webhooks/${id}/test`);
/** @param {number} id @param {AbortSignal} [signal] @returns {Promise<Delivery[]>} */
export const listDeliveries = (id, signal) => get(`/api/webhooks/${id}/deliveries`, signal);
/** @param {AbortSignal} [signal] @returns {Promise<Honeypot[]>} */
export const listHoneypots = (signal) => get("/api/honeypots", signal);
/** @param {string} id of a sample kitchen @param {HoneypotIn} how @returns {Promise<Honeypot>} */
export const slipHoneypot = (id, how) => takenOn(() => send("POST", `${of(id)}/honeypot`, how));
/** @param {string} id @returns {Promise<HoneypotScore>} */
export const scoreHoneypot = (id) => takenOn(() => get(`${of(id)}/honeypot`));
/** @param {string} id @param {AbortSignal} [signal] @returns {Promise<Opinion[]>} */
export const listOpinions = (id, signal) => get(`${of(id)}/opinions`, signal);
/** @param {string} id @param {string | null} name @returns {Promise<Project>} */
export const askOpinion = (id, name) => takenOn(() => send("POST", `${of(id)}/opinions`, { name }));
/** @param {string} id @param {string} other @returns {Promise<Agreement>} */
export const getAgreement = (id, other) => takenOn(() => get(`${of(id)}/opinions/${encodeURIComponent(other)}`));
/** Download address of the agreement table. @param {string} id @param {string} other */
export const agreementTable = (id, other) => `${of(id)}/opinions/${encodeURIComponent(other)}/agreement.csv`;
/** @param {AbortSignal} [signal] @returns {Promise<Template[]>} */
export const listTemplates = (signal) => get("/api/templates", signal);
/** @param {TemplateIn} template @returns {Promise<Template>} */
export const addTemplate = (template) => send("POST", "/api/templates", template);
/** @param {number} id @param {TemplateIn} template @returns {Promise<Template>} */
export const changeTemplate = (id, template) => send("PUT", `/api/templates/${id}`, template);
/** @param {number} id */
export const removeTemplate = (id) => call(`/api/templates/${id}`, { method: "DELETE" });
/** @param {string} id @param {number | null} template whose objects are to be clicked @returns {Promise<Project>} */
export const setChecklist = (id, template) => send("PUT", `${of(id)}/checklist`, { template });
/** @param {string} id @param {AbortSignal} [signal] @returns {Promise<ProjectMembers>} */
export const getMembers = (id, signal) => get(`${of(id)}/members`, signal);
/** @param {string} id @param {MembersIn} members @returns {Promise<ProjectMembers>} */
export const setMembers = (id, members) => send("PUT", `${of(id)}/members`, members);
/** @param {AbortSignal} [signal] @returns {Promise<Inbox>} */
export const getInbox = (signal) => get("/api/inbox", signal);
/** Names of the people who can be mentioned or assigned in a project. @param {string} id @returns {Promise<string[]>} */
export const listNames = (id) => get(`${of(id)}/people`);
/** @param {string} id @param {string | null} name @returns {Promise<Project>} */
export const assignProject = (id, name) => send("PUT", `${of(id)}/assignee`, { name });
/** @param {string} id @param {number} object @param {string | null} name @returns {Promise<SceneObject>} */
export const assignObject = (id, object, name) => send("PATCH", `${of(id)}/objects/${object}`, { assignee: name });
/** @param {string} id @param {AbortSignal} [signal] @returns {Promise<News>} */
export const getNews = (id, signal) => get(`${of(id)}/news`, signal);
/** @param {string} id @param {number} event last one read @returns {Promise<News>} */
export const markSeen = (id, event) => send("PUT", `${of(id)}/news`, { event });
/** @param {string} id @returns {Promise<FrameInfo[]>} */
export const listFrames = (id) => get(`${of(id)}/frames`);
/** @param {string} id @returns {Promise<HistoryEntry[]>} */
export const getHistory = (id) => get(`${of(id)}/history?limit=100`);

/** @returns {Promise<UnknownFolder[]>} */
export const listUnknown = () => get("/api/unknown");
/** @param {string} entry @returns {Promise<Project>} */
export const adoptUnknown = (entry) => send("POST", `/api/unknown/${encodeURIComponent(entry)}/adopt`);
/** @param {string} entry @returns {Promise<UnknownFolder>} */
export const leaveUnknown = (entry) => send("POST", `/api/unknown/${encodeURIComponent(entry)}/leave`);
/** @param {string} entry @returns {Promise<void>} */
export const discardUnknown = (entry) => send("POST", `/api/unknown/${encodeURIComponent(entry)}/discard`);

/** @returns {Promise<Upload[]>} */
export const listUploads = () => get("/api/uploads");
/** @param {string} id */
export const cancelUpload = (id) => call(`/api/uploads/${id}`, { method: "DELETE" });

/**
 * Upload a recording in pieces, resuming an earlier upload of the same file; a lost connection is retried.
 * @param {File} file
 * @param {(fraction: number, waiting: boolean) => void} onProgress
 * @param {AbortSignal} signal aborts the upload; the server keeps the part it has received, for resuming
 * @param {string} [project] project without a recording, which receives this one
 * @returns {Promise<Project>}
 */
export async function uploadRecording(file, onProgress, signal, project) {
  const wish = { file_name: file.name, size: file.size, modified: file.lastModified / 1000 };
  const upload = stoppedUpload(file, await listUploads()) ?? (await send("POST", "/api/uploads", wish));
  const path = `/api/uploads/${upload.id}`;
  /** @param {Response} response */
  const offsetOf = (response) => Number(response.headers.get("Upload-Offset"));
  await sendRest(file, upload.offset, {
    send: async (offset, piece) =>
      offsetOf(
        await call(path, { method: "PATCH", body: piece, signal, headers: { "Upload-Offset": String(offset) } }),
      ),
    ask: async () => offsetOf(await call(path, { method: "HEAD", signal })),
    mayPass: (error) =>
      error instanceof ApiError && (error.status === 0 || error.status === 409 || error.status === 503),
    onProgress: (sent, waiting) => onProgress(sent / file.size, waiting),
    wait,
  });
  return takenOn(() =>
    project ? send("PUT", `${of(project)}/recording`, { upload: upload.id }) : send("POST", `${path}/finish`),
  );
}

/** @param {string} id @returns {Promise<SceneObject[]>} */
export const listObjects = (id) => get(`${of(id)}/objects`);
/** @param {string} id @param {number} object @param {AbortSignal} [signal] @returns {Promise<ObjectPoints>} */
export const getObjectPoints = (id, object, signal) => get(`${of(id)}/objects/${object}/cloud`, signal);

/** @param {string} id @param {number} frame @returns {Promise<FrameCamera>} */
export const getCamera = (id, frame) => get(`${of(id)}/frames/${frame}/camera`);
/** @param {string} id @returns {Promise<LiveStatus>} */
export const openLive = (id) => send("POST", `${of(id)}/live/open`);
/** @param {string} id @returns {Promise<Lane[]>} */
export const getLanes = (id) => get(`${of(id)}/lanes`);
/** @param {string} id @returns {Promise<Opening[]>} */
export const getOpenings = (id) => get(`${of(id)}/openings`);
/** @param {string} id @param {number} frame @param {AbortSignal} [signal] @returns {Promise<FrameMask[]>} */
export const getMasks = (id, frame, signal) => get(`${of(id)}/masks/${frame}`, signal);

/** @param {string} id @returns {Promise<Elevations>} */
export const getElevations = (id) => get(`${of(id)}/elevations`);
/** @param {string} id @returns {Promise<FoundFront[]>} */
export const getFoundFronts = (id) => get(`${of(id)}/elevations/fronts`);
/** @param {string} id @param {AbortSignal} [signal] @returns {Promise<Proposals>} */
export const getProposals = (id, signal) => get(`${of(id)}/proposals`, signal);
/** @param {string} id @returns {Promise<Proposals>} */
export const restoreProposals = (id) => send("POST", `${of(id)}/proposals/restore`);

/** @param {string} id @param {Partial<RunRequest>} [request] @returns {Promise<Job>} */
export const startRun = (id, request) => send("POST", `${of(id)}/run`, request ?? {});
/** @param {string} id @returns {Promise<Job[]>} */
export const listJobs = (id) => get(`/api/jobs?${new URLSearchParams({ project: id })}`);
/** @param {number} job @returns {Promise<Job>} */
export const getJob = (job) => get(`/api/jobs/${job}`);
/** @param {number} job @returns {Promise<Job>} */
export const cancelJob = (job) => send("POST", `/api/jobs/${job}/cancel`);
/** @param {number} job @returns {Promise<Job>} */
export const retryJob = (job) => send("POST", `/api/jobs/${job}/retry`);
/** @param {number} job @returns {Promise<JobEvent[]>} */
export const getJobEvents = (job) => get(`/api/jobs/${job}/events`);
/** @param {number} job @returns {Promise<string>} */
export const getJobLog = async (job) => (await call(`/api/jobs/${job}/log`)).text();

/** @param {string} id @returns {Promise<CandidateGroup[]>} */
export const listCandidates = (id) => get(`${of(id)}/candidates`);
/** @param {string} id @param {CandidateGroup} seen @param {File} file @returns {Promise<Reviewed>} */
export const uploadCandidate = async (id, seen, file) => {
  const query = new URLSearchParams({ filename: file.name, version: String(seen.version) });
  const path = `${of(id)}/objects/${seen.object}/candidates?${query}`;
  return (await takenOn(() => call(path, { method: "POST", body: file }))).json();
};

/** @param {string} id @param {number} object @param {File} file @param {AbortSignal} signal @returns {Promise<MeshLook>} */
export const lookAtMesh = async (id, object, file, signal) => {
  const path = `${of(id)}/objects/${object}/mesh-look?${new URLSearchParams({ filename: file.name })}`;
  return (await takenOn(() => call(path, { method: "POST", body: file, signal }))).json();
};

/** @param {string} id @param {number} object @param {string} against a candidate @returns {Promise<Differences>} */
export const getDifferences = (id, object, against) =>
  takenOn(() => get(`${of(id)}/objects/${object}/differences?${new URLSearchParams({ against })}`));

/** @param {string} id @returns {Promise<ReviewStatus>} */
export const getReview = (id) => get(`${of(id)}/review`);
/** @param {string} id @param {ReviewStep} step @returns {Promise<ReviewStatus>} */
export const stepReview = (id, step) => send("POST", `${of(id)}/review`, step);
/** @param {string} id @returns {Promise<Figures>} */
export const getFigures = (id) => get(`${of(id)}/figures`);
/** @param {string} id @returns {Promise<Comment[]>} */
export const listComments = (id) => get(`${of(id)}/comments`);
/** @param {string} id @param {number} comment @param {boolean} resolved @returns {Promise<Comment>} */
export const resolveComment = (id, comment, resolved) => send("PATCH", `${of(id)}/comments/${comment}`, { resolved });

/** @param {string} id @param {number} object @returns {Promise<ObjectPhotos>} */
export const getPhotos = (id, object) => get(`${of(id)}/objects/${object}/photos`);

/** @param {string} id @returns {Promise<SceneSummary>} */
export const getScene = (id) => get(`${of(id)}/scene`);
/** @param {string} id @returns {Promise<TrueLengths>} */
export const listLengths = (id) => get(`${of(id)}/lengths`);
/** @param {string} id @param {TrueLengthIn} length @returns {Promise<TrueLengths>} */
export const addLength = (id, length) => send("POST", `${of(id)}/lengths`, length);
/** @param {string} id @param {number} length @returns {Promise<TrueLengths>} */
export const removeLength = (id, length) => send("DELETE", `${of(id)}/lengths/${length}`);
/** @param {string} id @returns {Promise<Certificate>} */
export const getCertificate = (id) => get(`${of(id)}/certificate`);
/** @param {string} id @returns {Promise<Bundle[]>} */
export const listBundles = (id) => get(`${of(id)}/bundles`);
/** @param {string} id @param {number} version @returns {Promise<BundleCheck>} */
export const checkBundle = (id, version) => get(`${of(id)}/bundles/${version}/check`);
/** @param {string} id @param {number} version @returns {Promise<BundleInside>} */
export const bundleInside = (id, version) => get(`${of(id)}/bundles/${version}/inside`);
/** @param {string} id @param {number} version @param {number} since @returns {Promise<BundleChange[]>} */
export const compareBundles = (id, version, since) => get(`${of(id)}/bundles/${version}/changes?since=${since}`);
/** @param {string} id @returns {Promise<Variants>} */
export const listVariants = (id) => get(`${of(id)}/variants`);
/** @param {string} id @param {VariantsIn} wish @returns {Promise<Job>} */
export const makeVariants = (id, wish) => send("POST", `${of(id)}/variants`, wish);
/** @param {string} id @param {string} name @returns {Promise<Variants>} */
export const deleteVariants = (id, name) => send("DELETE", `${of(id)}/variants/${name}`);
/** @param {string} id @returns {Promise<ViewerSession>} */
export const openViewer = (id) => takenOn(() => send("POST", `${of(id)}/viewer`));
/** @param {string} id @param {Partial<ViewerShow>} what @returns {Promise<ViewerShown>} */
export const showInViewer = (id, what) => takenOn(() => send("POST", `${of(id)}/viewer/show`, what));
/** @param {string} id @param {Record<string, number>} values @returns {Promise<ViewerShown>} */
export const moveJoints = (id, values) => takenOn(() => send("POST", `${of(id)}/viewer/joints`, { values }));
/**
 * Place the object being moved in the 3D view; with null, return where it was dragged.
 * @param {string} id
 * @param {number[][] | null} pose
 * @returns {Promise<ViewerPlaced>}
 */
export const placeInViewer = (id, pose) => takenOn(() => send("POST", `${of(id)}/viewer/place`, { pose }));
/** @param {string} id @returns {Promise<import("./api-types").ViewerCamera>} */
export const getViewerCamera = (id) => takenOn(() => get(`${of(id)}/viewer/camera`));
/** Target of the last click in the 3D view. @param {string} id @returns {Promise<ViewerPicked>} */
export const getPicked = (id) => takenOn(() => get(`${of(id)}/viewer/picked`));
