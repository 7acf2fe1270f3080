/** The only file with side effects: defines the shell's elements and starts the router. */

import { merged } from "./conflict.js";
import { AppShell } from "./elements/app-shell.js";
import { CommandPalette } from "./elements/command-palette.js";
import { HelpOverlay } from "./elements/help-overlay.js";
import { Toasts } from "./elements/toasts.js";
import { WhoIsIn } from "./elements/who.js";
import { outbox } from "./outbox.js";
import { Presence } from "./presence.js";
import { startRouter } from "./router.js";

customElements.define("r2c2r-toasts", Toasts);
customElements.define("r2c2r-who", WhoIsIn);
customElements.define("r2c2r-presence", Presence);
customElements.define("r2c2r-help", HelpOverlay);
customElements.define("r2c2r-palette", CommandPalette);
customElements.define("r2c2r-app", AppShell);

outbox.merge = merged;
const shell = document.querySelector("r2c2r-app");
if (shell instanceof AppShell) startRouter((route) => shell.show(route));
