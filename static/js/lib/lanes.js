/** Confidence along an object's lane: doubtful frames, and the frames to check first. */

export const DOUBTFUL = 0.5; // below this a mask is drawn hatched and offered for a second look

/**
 * The next frame, in that direction, whose mask is doubtful; null when there is none.
 * @param {{ index: number }[]} frames
 * @param {Map<number, number>} confidence by frame
 * @param {number} position
 * @param {1 | -1} step
 */
export function nextDoubtful(frames, confidence, position, step) {
  for (let k = position + step; k >= 0 && k < frames.length; k += step) {
    const sure = confidence.get(frames[k]?.index ?? -1);
    if (sure !== undefined && sure < DOUBTFUL) return k;
  }
  return null;
}

/**
 * Frames to check: the doubtful ones, then a selection evenly spread over the rest, at most `count`.
 * @param {Map<number, number>} confidence by frame
 * @param {number} count
 * @returns {{ frame: number, confidence: number }[]} worst first
 */
export function worstFirst(confidence, count) {
  const all = [...confidence].map(([frame, sure]) => ({ frame, confidence: sure }));
  const doubtful = all.filter((e) => e.confidence < DOUBTFUL).toSorted((a, b) => a.confidence - b.confidence);
  const sure = all.filter((e) => e.confidence >= DOUBTFUL).toSorted((a, b) => a.frame - b.frame);
  const room = Math.max(count - doubtful.length, 0);
  const shown = Math.min(room, sure.length);
  const spread = Array.from({ length: shown }, (_, k) => sure[Math.floor((k * sure.length) / shown)]).filter(
    (e) => e !== undefined,
  );
  return [...doubtful.slice(0, count), ...spread.toSorted((a, b) => a.confidence - b.confidence)];
}

/**
 * Runs of consecutive frames with a mask that are all sure or all doubtful.
 * @param {(number | undefined)[]} confidences by position; undefined where there is no mask
 */
export function runs(confidences) {
  /** @type {{ from: number, to: number, doubtful: boolean }[]} */
  const found = [];
  confidences.forEach((confidence, k) => {
    if (confidence === undefined) return;
    const doubtful = confidence < DOUBTFUL;
    const last = found.at(-1);
    if (last?.to === k && last.doubtful === doubtful) last.to = k + 1;
    else found.push({ from: k, to: k + 1, doubtful });
  });
  return found;
}
