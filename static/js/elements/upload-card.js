/** A file on its way to the server: how far it is, and a button that stops it; what arrived stays, to go on with. */

import { uploadRecording } from "../api.js";
import { h, LiveElement } from "../dom.js";
import { bytes } from "../lib/format.js";
import { say, sayError } from "./toasts.js";

export class UploadCard extends LiveElement {
  limit = Infinity; // bytes that the server takes

  connected() {
    this.className = "card";
    this.hidden = true;
  }

  /**
   * Send it; null where it was refused or stopped, which is said here.
   * @param {File} file a recording, or a project's file
   * @param {string} [project] that the recording is for; else it becomes one
   */
  async send(file, project) {
    if (file.size > this.limit) {
      const hint = "put it on this machine and import it by its path";
      say(`${file.name} is ${bytes(file.size)}; uploads end at ${bytes(this.limit)}`, { kind: "bad", hint });
      return null;
    }
    const controller = new AbortController();
    const bar = h("progress", { value: 0, max: 1, "aria-label": `Uploading ${file.name}` });
    const state = h("span", { class: "muted", role: "status" });
    const stop = h("button", { type: "button", onClick: () => controller.abort() }, "Stop");
    this.replaceChildren(h("div", { class: "row" }, `Uploading ${file.name}, ${bytes(file.size)}`, state, stop), bar);
    this.hidden = false;
    /** @param {number} fraction @param {boolean} waiting */
    const show = (fraction, waiting) => {
      bar.value = fraction;
      state.textContent = waiting
        ? "no connection: the upload resumes by itself"
        : fraction === 1
          ? "checking the file…"
          : "";
    };
    try {
      return await uploadRecording(file, show, controller.signal, project);
    } catch (error) {
      if (!controller.signal.aborted) sayError(error);
      return null;
    } finally {
      this.hidden = true;
    }
  }
}
