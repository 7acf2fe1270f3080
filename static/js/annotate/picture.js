/** Drawing of the overlays: masks, clicks, proposals and comments over the frame, and a lane per object below it. */

import { lanesOf, markersOn, masksOn } from "./layers.js";

/**
 * @typedef {object} Known
 * @property {import("./scene-objects.js").SceneObjects} objects
 * @property {import("./masks.js").Masks} masks
 * @property {() => import("../api-types").Opening[]} openings
 * @property {import("./edits.js").Edits} edits
 * @property {import("./player.js").Player} player
 * @property {import("../elements/proposal-list.js").ProposalList} proposals
 * @property {import("../elements/comment-list.js").CommentList} comments
 */

const LANES_MS = 250; // masks arrive in bursts

export class Picture {
  #known;
  #canvas;
  #strip;
  #lanesTimer = 0;

  /**
   * @param {Known} known
   * @param {import("../elements/frame-canvas.js").FrameCanvas} canvas
   * @param {import("../elements/film-strip.js").FilmStrip} strip
   */
  constructor(known, canvas, strip) {
    this.#known = known;
    this.#canvas = canvas;
    this.#strip = strip;
  }

  /** Redraw for another frame. */
  drawFrame() {
    this.drawMarkers();
    this.drawMasks();
    this.drawProposals();
    this.drawPins();
  }

  /** Redraw after a change of the objects. */
  drawObjects() {
    this.drawMarkers();
    this.drawMasks();
    this.drawLanes();
  }

  drawMarkers() {
    const { objects, edits } = this.#known;
    this.#canvas.setMarkers(markersOn(objects, edits.clicks, this.#frame));
  }

  /** @param {number | null} of the frame whose masks changed; null draws whichever is shown */
  drawMasks(of = null) {
    const { objects, masks } = this.#known;
    const frame = this.#frame;
    if (frame !== undefined && (of ?? frame) === frame) this.#canvas.setMasks(masksOn(objects, masks, frame));
  }

  drawProposals() {
    const frame = this.#frame;
    this.#canvas.setOutlines(frame === undefined ? [] : this.#known.proposals.outlinesOn(frame));
  }

  drawPins() {
    const here = this.#known.comments.open.filter((comment) => comment.frame === this.#frame);
    this.#canvas.setPins(here.map(({ id, x, y, text }) => ({ id, x: x ?? 0, y: y ?? 0, text })));
  }

  drawLanes() {
    this.stop();
    this.#strip.setLanes(lanesOf(this.#known.objects, this.#known.masks, this.#known.openings()));
  }

  /** Draw the lanes after a short delay, once for all changes until then. */
  drawLanesSoon() {
    this.#lanesTimer ||= window.setTimeout(() => this.drawLanes(), LANES_MS);
  }

  stop() {
    clearTimeout(this.#lanesTimer);
    this.#lanesTimer = 0;
  }

  get #frame() {
    return this.#known.player.frame?.index;
  }
}
