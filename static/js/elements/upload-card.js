/** Progress of an upload, with a stop button; the part already received is kept, to resume from. */

import { uploadRecording } from "../api.js";
import { h, LiveElement } from "../dom.js";
import { bytes } from "../lib/format.js";
import { say, sayError } from "./toasts.js";

export class UploadCard extends LiveElement {
  limit = Infinity; // most bytes the server accepts

  connected() {
    this.className = "card";
    this.hidden = true;
  }

  /**
   * Upload a file; null if it was refused, with a message, or stopped.
   * @param {File} file a recording or an exported project
   * @param {string} [project] project to attach the recording to; else a new one is created
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
