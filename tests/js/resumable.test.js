import assert from "node:assert/strict";
import { test } from "node:test";

import { PIECE, sendRest, stoppedUpload } from "../../static/js/lib/resumable.js";

const file = new Blob([new Uint8Array(2 * PIECE + 10)]);

/** Mock server that stores half of a piece and then loses the connection, this number of times. */
function faultyServer(failures) {
  const kept = { bytes: 0, sends: 0, failures };
  return {
    kept,
    send: async (offset, piece) => {
      assert.equal(offset, kept.bytes);
      kept.sends += 1;
      if (kept.failures-- > 0) {
        kept.bytes += piece.size >> 1;
        throw new Error("lost");
      }
      return (kept.bytes += piece.size);
    },
    ask: async () => kept.bytes,
    mayPass: (error) => error.message === "lost",
    onProgress: () => {},
    wait: async () => {},
  };
}

test("an upload continues at the server's offset after each lost connection", async () => {
  const sends = { 0: 3, 1: 3, 5: 6 }; // by failures: half a piece arrives with each, so that fewer are left
  for (const failures of [0, 1, 5]) {
    const server = faultyServer(failures);
    await sendRest(file, 0, server);
    assert.deepEqual([server.kept.bytes, server.kept.sends], [file.size, sends[failures]]);
  }
});

test("a refused upload fails with the server's error", async () => {
  const refusing = {
    ...faultyServer(0),
    send: async () => Promise.reject(new Error("too large")),
  };
  await assert.rejects(sendRest(file, 0, refusing), /too large/);
});

test("a stopped upload is continued only with a file of the same name, size and date", () => {
  const stopped = { file_name: "a.r3d", size: 9, modified: 1.5, offset: 3 };
  assert.equal(stoppedUpload({ name: "a.r3d", size: 9, lastModified: 1500 }, [stopped]), stopped);
  for (const other of [{ name: "b.r3d" }, { size: 8 }, { lastModified: 1501 }])
    assert.equal(stoppedUpload({ name: "a.r3d", size: 9, lastModified: 1500, ...other }, [stopped]), undefined);
});
