/** The only file with side effects: defines the elements and starts the router. */

import { AppShell } from "./elements/app-shell.js";
import { FilmStrip } from "./elements/film-strip.js";
import { FolderDialog } from "./elements/folder-dialog.js";
import { FrameCanvas } from "./elements/frame-canvas.js";
import { HelpOverlay } from "./elements/help-overlay.js";
import { JobPanel } from "./elements/job-panel.js";
import { ObjectList } from "./elements/object-list.js";
import { ProposalList } from "./elements/proposal-list.js";
import { SegmenterChoice } from "./elements/segmenter-choice.js";
import { Toasts } from "./elements/toasts.js";
import { ViewerFrame } from "./elements/viewer-frame.js";
import { WhoIsIn } from "./elements/who.js";
import { AnnotatePage } from "./pages/annotate.js";
import { DownloadPage } from "./pages/download.js";
import { OverviewPage } from "./pages/overview.js";
import { ProjectsPage } from "./pages/projects.js";
import { ReviewPage } from "./pages/review.js";
import { RunPage } from "./pages/run.js";
import { startRouter } from "./router.js";

customElements.define("r2c2r-toasts", Toasts);
customElements.define("r2c2r-who", WhoIsIn);
customElements.define("r2c2r-help", HelpOverlay);
customElements.define("r2c2r-folder-dialog", FolderDialog);
customElements.define("r2c2r-job", JobPanel);
customElements.define("r2c2r-frame-canvas", FrameCanvas);
customElements.define("r2c2r-film-strip", FilmStrip);
customElements.define("r2c2r-object-list", ObjectList);
customElements.define("r2c2r-segmenter", SegmenterChoice);
customElements.define("r2c2r-proposal-list", ProposalList);
customElements.define("r2c2r-viewer", ViewerFrame);
customElements.define("r2c2r-projects", ProjectsPage);
customElements.define("r2c2r-overview", OverviewPage);
customElements.define("r2c2r-annotate", AnnotatePage);
customElements.define("r2c2r-run", RunPage);
customElements.define("r2c2r-review", ReviewPage);
customElements.define("r2c2r-download", DownloadPage);
customElements.define("r2c2r-app", AppShell);

const shell = document.querySelector("r2c2r-app");
if (shell instanceof AppShell) startRouter((route) => shell.show(route));
