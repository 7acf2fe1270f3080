/**
 * Runs in viser's page, before its own code. It draws on demand, but also once a second in case a change asked for no frame.
 * Where a frame takes seconds, as without a GPU under load, that keeps the thread busy which our pages share. So the next such
 * frame waits until the last one's share of the time is a tenth.
 */
{
  const HEARTBEAT_MS = 1000; // of viser 1.1.1
  const PAUSE = 9; // times the last frame's duration
  const every = globalThis.setInterval;
  /** @param {(...given: unknown[]) => void} act @param {number} ms @param {unknown[]} rest */
  const eased = (act, ms, ...rest) => {
    if (ms !== HEARTBEAT_MS) return every(act, ms, ...rest);
    let next = 0;
    return every(() => {
      const began = performance.now();
      if (began < next) return;
      act(...rest);
      const drawn = () => (next = performance.now() + PAUSE * (performance.now() - began));
      requestAnimationFrame(() => requestAnimationFrame(drawn)); // the second one begins when the first is drawn
    }, ms);
  };
  Object.assign(globalThis, { setInterval: eased });
}
