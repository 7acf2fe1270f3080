/** Upload of a file in pieces, resumable after a lost connection. No DOM: the requests are passed in. */

export const PIECE = 4 << 20;
const FIRST_WAIT_MS = 500;
const LONGEST_WAIT_MS = 10_000;

/**
 * Send the missing part; resolves when the server has the whole file. After a failure that `mayPass`, it waits and requests the
 * server's offset before continuing.
 * @param {Blob} file
 * @param {number} offset where the server's copy ends
 * @param {{
 *   send: (offset: number, piece: Blob) => Promise<number>,
 *   ask: () => Promise<number>,
 *   mayPass: (error: unknown) => boolean,
 *   onProgress: (sent: number, waiting: boolean) => void,
 *   wait: (ms: number) => Promise<void>,
 * }} ways
 */
export async function sendRest(file, offset, ways) {
  let pause = FIRST_WAIT_MS;
  let known = true;
  while (!known || offset < file.size) {
    try {
      if (!known) offset = await ways.ask();
      known = true;
      ways.onProgress(offset, false);
      if (offset < file.size) offset = await ways.send(offset, file.slice(offset, offset + PIECE));
      ways.onProgress(offset, false);
      pause = FIRST_WAIT_MS;
    } catch (error) {
      if (!ways.mayPass(error)) throw error;
      known = false;
      ways.onProgress(offset, true);
      await ways.wait(pause);
      pause = Math.min(pause * 2, LONGEST_WAIT_MS);
    }
  }
}

/**
 * Interrupted upload of this same file, if there is one.
 * @template {{ file_name: string, size: number, modified: number | null, offset: number }} T
 * @param {{ name: string, size: number, lastModified: number }} file
 * @param {T[]} uploads
 * @returns {T | undefined}
 */
export function stoppedUpload(file, uploads) {
  return uploads.find(
    (upload) =>
      upload.file_name === file.name && upload.size === file.size && upload.modified === file.lastModified / 1000,
  );
}
