/** Pages that are large or seldom opened, fetched with their elements when they are first opened: the list of projects does not wait for them. */

/** @typedef {Record<string, CustomElementConstructor>} Elements */

/** @type {Record<string, () => Promise<Elements>>} */
const LATER = {
  annotate: async () => {
    const [page, strip, canvas, list, proposals, mosaic, cloud, comments] = await Promise.all([
      import("./pages/annotate.js"),
      import("./elements/film-strip.js"),
      import("./elements/frame-canvas.js"),
      import("./elements/object-list.js"),
      import("./elements/proposal-list.js"),
      import("./elements/frame-mosaic.js"),
      import("./elements/object-cloud.js"),
      import("./elements/comment-list.js"),
    ]);
    return {
      "r2c2r-film-strip": strip.FilmStrip,
      "r2c2r-frame-canvas": canvas.FrameCanvas,
      "r2c2r-object-list": list.ObjectList,
      "r2c2r-proposal-list": proposals.ProposalList,
      "r2c2r-mosaic": mosaic.FrameMosaic,
      "r2c2r-object-cloud": cloud.ObjectCloud,
      "r2c2r-comments": comments.CommentList,
      "r2c2r-annotate": page.AnnotatePage,
    };
  },
  people: async () => ({ "r2c2r-people": (await import("./pages/people.js")).PeoplePage }),
  review: async () => {
    const [page, photos, comments] = await Promise.all([
      import("./pages/review.js"),
      import("./elements/photo-check.js"),
      import("./elements/comment-list.js"),
    ]);
    return {
      "r2c2r-photo-check": photos.PhotoCheck,
      "r2c2r-comments": comments.CommentList,
      "r2c2r-review": page.ReviewPage,
    };
  },
};

/**
 * Fetch a page that is not here yet; null when there is nothing to wait for.
 * @param {string} page
 * @returns {Promise<void> | null}
 */
export function fetched(page) {
  const load = LATER[page];
  if (!load || customElements.get(`r2c2r-${page}`)) return null;
  return load().then((elements) => {
    for (const [name, element] of Object.entries(elements)) {
      if (!customElements.get(name)) customElements.define(name, element);
    }
  });
}
