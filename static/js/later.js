/** Lazy loading of pages and their elements when first needed; the HTML preloads those of the first page. */

/** @type {Record<string, () => Promise<CustomElementConstructor>>} */
const ELEMENTS = {
  "r2c2r-agreement": async () => (await import("./pages/agreement.js")).AgreementPage,
  "r2c2r-annotate": async () => (await import("./pages/annotate.js")).AnnotatePage,
  "r2c2r-audit-record": async () => (await import("./elements/audit-record.js")).AuditRecord,
  "r2c2r-assignee": async () => (await import("./elements/assignee.js")).Assignee,
  "r2c2r-backend": async () => (await import("./elements/backend-choice.js")).BackendChoice,
  "r2c2r-candidate-compare": async () => (await import("./review/compare.js")).CandidateCompare,
  "r2c2r-checklist": async () => (await import("./elements/object-checklist.js")).ObjectChecklist,
  "r2c2r-comments": async () => (await import("./elements/comment-list.js")).CommentList,
  "r2c2r-download": async () => (await import("./pages/download.js")).DownloadPage,
  "r2c2r-elevation": async () => (await import("./pages/elevation.js")).ElevationPage,
  "r2c2r-elevation-canvas": async () => (await import("./elements/elevation-canvas.js")).ElevationCanvas,
  "r2c2r-film-strip": async () => (await import("./elements/film-strip.js")).FilmStrip,
  "r2c2r-folder-dialog": async () => (await import("./elements/folder-dialog.js")).FolderDialog,
  "r2c2r-frame-canvas": async () => (await import("./elements/frame-canvas.js")).FrameCanvas,
  "r2c2r-honeypots": async () => (await import("./elements/honeypot-list.js")).HoneypotList,
  "r2c2r-inbox": async () => (await import("./pages/inbox.js")).InboxPage,
  "r2c2r-job": async () => (await import("./elements/job-panel.js")).JobPanel,
  "r2c2r-members": async () => (await import("./elements/member-list.js")).MemberList,
  "r2c2r-mosaic": async () => (await import("./elements/frame-mosaic.js")).FrameMosaic,
  "r2c2r-news": async () => (await import("./elements/news-list.js")).NewsList,
  "r2c2r-object-cloud": async () => (await import("./elements/object-cloud.js")).ObjectCloud,
  "r2c2r-object-list": async () => (await import("./elements/object-list.js")).ObjectList,
  "r2c2r-opinions": async () => (await import("./elements/opinion-list.js")).OpinionList,
  "r2c2r-overview": async () => (await import("./pages/overview.js")).OverviewPage,
  "r2c2r-people": async () => (await import("./pages/people.js")).PeoplePage,
  "r2c2r-photo-check": async () => (await import("./elements/photo-check.js")).PhotoCheck,
  "r2c2r-projects": async () => (await import("./pages/projects.js")).ProjectsPage,
  "r2c2r-proposal-list": async () => (await import("./elements/proposal-list.js")).ProposalList,
  "r2c2r-review-state": async () => (await import("./elements/review-state.js")).ReviewState,
  "r2c2r-review": async () => (await import("./pages/review.js")).ReviewPage,
  "r2c2r-run": async () => (await import("./pages/run.js")).RunPage,
  "r2c2r-seat-list": async () => (await import("./elements/seat-list.js")).SeatList,
  "r2c2r-templates": async () => (await import("./pages/templates.js")).TemplatesPage,
  "r2c2r-trash-list": async () => (await import("./elements/trash-list.js")).TrashList,
  "r2c2r-true-lengths": async () => (await import("./elements/true-lengths.js")).TrueLengthList,
  "r2c2r-unknown-list": async () => (await import("./elements/unknown-list.js")).UnknownList,
  "r2c2r-upload-card": async () => (await import("./elements/upload-card.js")).UploadCard,
  "r2c2r-variants": async () => (await import("./elements/variant-sets.js")).VariantSets,
  "r2c2r-viewer": async () => (await import("./elements/viewer-frame.js")).ViewerFrame,
  "r2c2r-webhooks": async () => (await import("./pages/webhooks.js")).WebhooksPage,
};

/** Elements that a page uses. @type {Record<string, string[]>} */
const PARTS = {
  annotate: ["film-strip", "frame-canvas", "object-list", "proposal-list", "mosaic", "object-cloud", "comments"],
  download: ["job", "variants"],
  elevation: ["elevation-canvas"],
  people: ["audit-record", "honeypots", "seat-list"],
  overview: [
    "assignee",
    "backend",
    "checklist",
    "job",
    "members",
    "news",
    "opinions",
    "true-lengths",
    "upload-card",
    "viewer",
  ],
  projects: ["folder-dialog", "trash-list", "unknown-list", "upload-card"],
  review: ["photo-check", "comments", "viewer", "candidate-compare", "review-state"],
  run: ["job"],
};

/** Style sheets used by a single page. @type {Record<string, string>} */
const STYLES = { elevation: "elevation", review: "compare" };

/**
 * Load a page that is not loaded yet; null if there is nothing to wait for.
 * @param {string} page
 * @returns {Promise<void> | null}
 */
export function fetched(page) {
  if (customElements.get(`r2c2r-${page}`)) return null;
  const tags = [...(PARTS[page] ?? []), page].map((part) => `r2c2r-${part}`);
  return Promise.all([fetchAll(tags), styled(STYLES[page])]).then(() => {});
}

/**
 * Add a style sheet and wait for it: without it, a page would be drawn twice.
 * @param {string | undefined} name
 * @returns {Promise<void>}
 */
function styled(name) {
  const href = import.meta.resolve(`../css/${name}.css`);
  if (!name || document.querySelector(`link[href="${href}"]`)) return Promise.resolve();
  const link = Object.assign(document.createElement("link"), { rel: "stylesheet", href });
  return new Promise((done) => {
    link.onload = link.onerror = () => done();
    document.head.append(link);
  });
}

/** Load elements and define them in this order: a page creates its parts. @param {string[]} tags */
async function fetchAll(tags) {
  const found = await Promise.all(tags.map((tag) => ELEMENTS[tag]?.()));
  for (const [k, element] of found.entries()) {
    const tag = /** @type {string} */ (tags[k]);
    if (element && !customElements.get(tag)) customElements.define(tag, element);
  }
}
