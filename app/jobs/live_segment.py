"""The live segmenter of one project, in a process of its own: `python -m app.jobs.live_segment WORKDIR --width 960
--segmenter geometric`.

Reads JSON lines: {"cmd": "segment", "object", "key", "prompt"} · {"cmd": "cancel", "object"} · {"cmd": "propose"} · end of
input stops it.
Prints JSON lines: {"state": "preparing", "fraction", "text"} … {"state": "ready", "total"}, then for every object
{"object", "key", "frame", "confidence", "mask"} (the clicked frame first) and {"object", "key", "end"}. The newest click
goes first; the objects it interrupted go on afterwards. Proposals, {"proposals": [...], "fraction"}, wait until no click does.
"""

import argparse
import json
import queue
import sys
import threading
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from app.jobs.mask_wire import mask_bits
from app.jobs.proposal_wire import proposal_line
from r2c2r_core.errors import InputError, R2C2RError
from r2c2r_core.geometry.masks import PackedMask
from r2c2r_core.model.inputs import ObjectPrompt
from r2c2r_core.model.proposal import Proposal
from r2c2r_core.progress import Progress
from r2c2r_core.segment.prompts import check_prompt, parse_prompts
from r2c2r_core.segment.stage import SEGMENTERS, open_session
from r2c2r_core.workspace import Workspace

Commands = queue.Queue[dict[str, Any] | None]


def main(arguments: list[str] | None = None) -> int:
    """Prepare, then answer clicks until the input ends."""
    parser = argparse.ArgumentParser(prog="app.jobs.live_segment", description=__doc__)
    parser.add_argument("workdir", type=Path)
    parser.add_argument("--width", type=int, default=960)
    parser.add_argument("--segmenter", default=SEGMENTERS.default)
    options = parser.parse_args(arguments)
    commands: Commands = queue.Queue()
    threading.Thread(target=_read_commands, args=(commands,), daemon=True).start()
    try:
        desk = _open_desk(options.workdir, options.width, options.segmenter)
    except R2C2RError as error:
        _say(state="failed", error={"kind": type(error).__name__, "message": error.message, "hint": error.hint})
        return error.exit_code
    except Exception as error:  # the edge of the process: the traceback goes to the log
        traceback.print_exc()
        _say(
            state="failed",
            error={"kind": "internal", "message": f"unexpected: {error}", "hint": "see the log of the live segmenter"},
        )
        return 1
    _say(state="ready", total=desk.total)
    desk.answer(commands)
    return 0


class Desk:
    """The objects being segmented, the one asked for last on top."""

    def __init__(self, session: Any, capture: Any, width: int) -> None:
        self.session, self.capture, self.width = session, capture, width
        self.total = len(capture.frames)
        self._open: dict[int, tuple[str, Iterator[tuple[int, PackedMask, float]]]] = {}
        self._proposing: Iterator[tuple[float, tuple[Proposal, ...]]] | None = None

    def answer(self, commands: Commands) -> None:
        """Take commands when there are any, else compute one more mask."""
        while True:
            try:
                command = commands.get(block=not self._open and self._proposing is None)
            except queue.Empty:
                self._step()
                continue
            if command is None:
                return
            self._take(command)

    def _take(self, command: dict[str, Any]) -> None:
        if command["cmd"] == "propose":
            self._proposing = self._proposing or self.session.propose()
            return
        number = int(command["object"])
        stopped = self._open.pop(number, None)
        if command["cmd"] == "cancel":
            if stopped is not None:
                _say(object=number, key=stopped[0], end="cancelled")
            return
        key = str(command["key"])
        try:
            prompt = _prompt(command["prompt"])
            check_prompt(self.capture, prompt)
            self._open[number] = (key, iter(self.session.stream(prompt)))
        except R2C2RError as error:
            _fail(number, key, error)

    def _step(self) -> None:
        if self._open:
            self._segment_step()
        else:
            self._propose_step()

    def _propose_step(self) -> None:
        assert self._proposing is not None
        try:
            fraction, found = next(self._proposing)
        except StopIteration:
            self._proposing = None
        except Exception as error:  # clicks go on working without proposals
            traceback.print_exc()
            self._proposing = None
            _say(proposals=[], fraction=1.0, error=f"no proposals: {error}")
        else:
            _say(proposals=[proposal_line(proposal, self.width) for proposal in found], fraction=round(fraction, 3))

    def _segment_step(self) -> None:
        number, (key, masks) = next(reversed(self._open.items()))
        try:
            frame, packed, confidence = next(masks)
        except StopIteration:
            del self._open[number]
            _say(object=number, key=key, end="done")
        except R2C2RError as error:
            del self._open[number]
            _fail(number, key, error)
        except Exception as error:  # one object must not take the others with it
            traceback.print_exc()
            del self._open[number]
            _fail(number, key, R2C2RError(f"unexpected: {error}", hint="see the log of the live segmenter"))
        else:
            share = packed.area_px / max(packed.width * packed.height, 1)
            mask = mask_bits(packed, self.width)
            _say(
                object=number,
                key=key,
                frame=int(frame),
                confidence=round(float(confidence), 4),
                area=round(share, 6),
                mask=mask,
            )


def _open_desk(workdir: Path, width: int, segmenter: str) -> Desk:
    work = Workspace(workdir)
    capture = work.load_latest("ingest", "scene")
    if capture is None:
        raise InputError("the recording has not been read yet", hint="wait for the import")
    progress = Progress(
        lambda _, fraction, text: _say(state="preparing", fraction=round(fraction, 3), text=text), stage="segment"
    )
    session = open_session(capture, work.cache, segmenter, progress=progress)
    return Desk(session, capture, width)


def _prompt(document: dict[str, Any]) -> ObjectPrompt:
    return parse_prompts({"version": 1, "objects": [document]}).objects[0]


def _fail(number: int, key: str, error: R2C2RError) -> None:
    _say(
        object=number, key=key, end="failed", error={"kind": type(error).__name__, "message": error.message, "hint": error.hint}
    )


def _read_commands(commands: Commands) -> None:
    for line in sys.stdin:
        commands.put(json.loads(line))
    commands.put(None)


def _say(**message: object) -> None:
    sys.stdout.write(json.dumps(message) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
