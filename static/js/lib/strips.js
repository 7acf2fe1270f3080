/** Small bar charts of a recording over its frames: height of each bar, and outliers. */

/** @typedef {import("../api-types").CaptureMoment} Moment */
/** @typedef {{ frame: number, height: number, off: boolean, text: string }} Bar */
/** @typedef {{ name: string, summary: string, bars: Bar[] }} Strip */

/**
 * One strip per measured quantity; heights 0 to 1.
 * @param {Moment[]} moments
 * @returns {Strip[]}
 */
export function strips(moments) {
  const errors = moments.flatMap((moment) => (moment.error_mm === null ? [] : [moment.error_mm]));
  const most = Math.max(30, ...errors);
  const usual = median(errors);
  return [
    strip(moments, "Sharpness", "blurred", (m) => ({
      height: m.sharpness / 2,
      off: m.sharpness < 1 / 3,
      text: `${m.sharpness.toFixed(2)} × the usual`,
    })),
    strip(moments, "Depth", "with little depth", (m) => ({
      height: m.depth_share,
      off: m.depth_share < 0.35,
      text: `${percent(m.depth_share)} of the pixels`,
    })),
    strip(moments, "Brightness", "too dark or too bright", (m) => ({
      height: m.brightness,
      off: m.brightness < 0.08 || m.brightness > 0.92,
      text: percent(m.brightness),
    })),
    strip(moments, "Depth mismatch", "whose depth does not match their neighbours", (m) => ({
      height: (m.error_mm ?? 0) / most,
      off: m.error_mm !== null && m.error_mm > Math.max(15, 3 * usual),
      text: m.error_mm === null ? "no other frame to compare with" : `${m.error_mm.toFixed(0)} mm`,
    })),
  ];
}

/**
 * @param {Moment[]} moments
 * @param {string} name
 * @param {string} problem
 * @param {(moment: Moment) => Omit<Bar, "frame">} draw
 * @returns {Strip}
 */
function strip(moments, name, problem, draw) {
  const bars = moments.map((moment) => {
    const bar = draw(moment);
    return { ...bar, height: Math.min(Math.max(bar.height, 0), 1), frame: moment.frame_index };
  });
  const off = bars.filter((bar) => bar.off).length;
  return { name, bars, summary: off ? `${off} of ${bars.length} frames ${problem}` : "no frame stands out" };
}

/** @param {number} share */
function percent(share) {
  return `${Math.round(100 * share)} %`;
}

/** @param {number[]} values */
function median(values) {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.floor(sorted.length / 2)] ?? 0;
}
