/** The only file with side effects: defines the elements and starts the router. */

import { AppShell } from "./elements/app-shell.js";
import { BackendChoice } from "./elements/backend-choice.js";
import { CommandPalette } from "./elements/command-palette.js";
import { FolderDialog } from "./elements/folder-dialog.js";
import { HelpOverlay } from "./elements/help-overlay.js";
import { JobPanel } from "./elements/job-panel.js";
import { ReviewState } from "./elements/review-state.js";
import { Toasts } from "./elements/toasts.js";
import { ViewerFrame } from "./elements/viewer-frame.js";
import { WhoIsIn } from "./elements/who.js";
import { DownloadPage } from "./pages/download.js";
import { OverviewPage } from "./pages/overview.js";
import { ProjectsPage } from "./pages/projects.js";
import { RunPage } from "./pages/run.js";
import { outbox } from "./outbox.js";
import { Presence } from "./presence.js";
import { startRouter } from "./router.js";

customElements.define("r2c2r-toasts", Toasts);
customElements.define("r2c2r-who", WhoIsIn);
customElements.define("r2c2r-presence", Presence);
customElements.define("r2c2r-help", HelpOverlay);
customElements.define("r2c2r-palette", CommandPalette);
customElements.define("r2c2r-review-state", ReviewState);
customElements.define("r2c2r-folder-dialog", FolderDialog);
customElements.define("r2c2r-job", JobPanel);
customElements.define("r2c2r-backend", BackendChoice);
customElements.define("r2c2r-viewer", ViewerFrame);
customElements.define("r2c2r-projects", ProjectsPage);
customElements.define("r2c2r-overview", OverviewPage);
customElements.define("r2c2r-run", RunPage);
customElements.define("r2c2r-download", DownloadPage);
customElements.define("r2c2r-app", AppShell);

outbox.merge = async (change, stored) => (await import("./conflict.js")).merged(change, stored);
const shell = document.querySelector("r2c2r-app");
if (shell instanceof AppShell) startRouter((route) => shell.show(route));
