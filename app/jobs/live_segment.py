"""The live segmenter of one project, in a process of its own: `python -m app.jobs.live_segment WORKDIR --width 960
--segmenter geometric --elevations FOLDER`.

Reads JSON lines: {"cmd": "segment", "object", "key", "prompt", "objects"} · {"cmd": "cancel", "object"} · {"cmd": "objects",
"objects"} · {"cmd": "propose"} · end of input stops it. `objects` are all current objects of the project (app.jobs.disputes);
a segment command omits them if further commands follow at once.
Prints JSON lines: {"state": "preparing", "fraction", "text"} … {"state": "ready", "total"}, then for every object
{"object", "key", "frame", "confidence", "mask"} (the clicked frame first: a quick preview, then its mask again if it differs)
and {"object", "key", "end", "front", "others", "doubts", "motions"}. The newest click has priority; others continue
afterwards. {"object", "key", "again": [...]} requests a segment command for an object whose masks changed because of clicks
on the listed objects, or, if empty, because there are none any more.
Proposals, {"proposals": [...], "fraction"}, are computed while no click is pending.
"""

import argparse
import contextlib
import json
import queue
import sys
import threading
import traceback
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from app.errors import told
from app.jobs.disputes import Again, Disputes, others_line, read_prompt
from app.jobs.doubts import doubts_about, suggested_category
from app.jobs.elevation_files import write_elevations
from app.jobs.front_wire import front_line
from app.jobs.mask_wire import mask_bits
from app.jobs.motion_wire import motion_lines
from app.jobs.proposal_wire import proposal_line
from r2c2r_core.errors import InputError, R2C2RError
from r2c2r_core.limits import limit_this_process, memory_met
from r2c2r_core.model.capture import Capture
from r2c2r_core.model.inputs import FrameSaid, ObjectPrompt
from r2c2r_core.model.proposal import Proposal
from r2c2r_core.model.track import FrontPanel
from r2c2r_core.progress import Progress
from r2c2r_core.segment.corrected import corrected_stream
from r2c2r_core.segment.prompts import check_prompt
from r2c2r_core.segment.protocol import Glimpse, SegmentSession
from r2c2r_core.segment.stage import SEGMENTERS, open_session
from r2c2r_core.workspace import Workspace

Commands = queue.Queue[dict[str, Any] | None]

_speaking = threading.Lock()


def main(arguments: list[str] | None = None) -> int:
    """Prepare the recording, then process commands until the input ends."""
    parser = argparse.ArgumentParser(prog="app.jobs.live_segment", description=__doc__)
    parser.add_argument("workdir", type=Path)
    parser.add_argument("--width", type=int, default=960)
    parser.add_argument("--segmenter", default=SEGMENTERS.default)
    parser.add_argument("--elevations", type=Path, help="folder that the planes are drawn into, for whoever edits fronts")
    options = parser.parse_args(arguments)
    commands: Commands = queue.Queue()
    threading.Thread(target=_read_commands, args=(commands,), daemon=True).start()
    try:
        desk = _open_desk(options.workdir, options.width, options.segmenter)
        if options.elevations is not None:
            write_elevations(options.elevations, desk.session.elevations())
    except R2C2RError as error:
        _say(state="failed", error=told(error))
        return error.exit_code
    except MemoryError:
        traceback.print_exc()
        _say(state="failed", error=told(memory_met()))
        return 1
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


@dataclass(eq=False, slots=True)
class _Followed:
    """An object being propagated through the frames."""

    key: str
    prompt: ObjectPrompt
    said: tuple[FrameSaid, ...]  # corrections in single frames
    glimpsed: Glimpse | None  # preview already shown
    masks: Iterator[Glimpse] | None = None  # None until propagation starts


class Desk:
    """Stack of objects being segmented, the most recent request on top.

    One thread reads commands and answers clicks with a preview; another propagates masks through the frames, and prefetches
    likely next requests while idle.
    """

    def __init__(self, session: SegmentSession, capture: Capture, width: int) -> None:
        self.session, self.capture, self.width = session, capture, width
        self.total = len(capture.frames)
        self._open: dict[int, _Followed] = {}
        self._objects: list[dict[str, Any]] = []  # the project's, as last received
        self._settled = self._objects  # those with resolved disputes
        self._disputes = Disputes(session, self._front)
        self._prefetching: Iterator[None] | None = session.prefetch()
        self._proposing: Iterator[tuple[float, tuple[Proposal, ...]]] | None = None
        self._closed = self._answering = False
        self._changed = threading.Condition()  # guards the fields above, and the order of messages about an object

    def answer(self, commands: Commands) -> None:
        """Process commands until the input ends."""
        worker = threading.Thread(target=self._work, name="frames")
        worker.start()
        while (waiting := _waiting(commands)) is not None:
            self._answering = True
            for command in waiting:
                self._take(command)
            with self._changed:
                self._answering = False
                self._changed.notify()
        with self._changed:
            self._closed = True
            self._changed.notify()
        worker.join()

    def _take(self, command: dict[str, Any]) -> None:
        if command["cmd"] == "propose":
            with self._changed:
                self._proposing = self._proposing or self.session.propose()
                self._changed.notify()
            return
        if command["cmd"] == "objects":
            self._learn(command["objects"])
            return
        number = int(command["object"])
        with self._changed:
            stopped = self._open.pop(number, None)
            if stopped is not None and command["cmd"] == "cancel":
                _say(object=number, key=stopped.key, end="cancelled")
        if command["cmd"] == "segment":
            self._follow(number, str(command["key"]), command["prompt"], command.get("objects"))

    def _learn(self, objects: list[dict[str, Any]]) -> None:
        with self._changed:
            self._objects = objects
            self._changed.notify()

    def _follow(self, number: int, key: str, document: dict[str, Any], objects: list[dict[str, Any]] | None) -> None:
        """Show a preview, then start propagation through the frames.

        Interactions with clicks on other objects are resolved after the preview, without delaying it.
        """
        try:
            prompt = read_prompt(document)
            check_prompt(self.capture, prompt)
            asked = replace(prompt, others=self._disputes.drawn_with(number, key) or ())
            glimpsed = self.session.glimpse(asked) if not prompt.frames else None  # the preview may be of a corrected frame
            first = self._shown(glimpsed) if glimpsed is not None else None
        except Exception as error:
            _say(object=number, key=key, **_failed(error))
            if objects is not None:
                self._learn(objects)
            return
        with self._changed:
            if first is not None:
                _say(object=number, key=key, **first)
            self._open[number] = _Followed(key, asked, prompt.frames, glimpsed)
            self._objects = self._objects if objects is None else objects
            self._changed.notify()

    def _work(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(self._may_work)
                if self._closed:
                    return
                newest = next(reversed(self._open.items()), None)
                waiting = {number for number, followed in self._open.items() if followed.masks is None}
                objects = self._objects
            if objects is not self._settled:
                self._settle(objects, waiting)
            elif newest is not None:
                self._segment_step(*newest)
            elif self._prefetching is not None:
                self._prefetch_step()
            else:
                self._propose_step()

    def _may_work(self) -> bool:
        """Whether there is work to do and no preview is pending."""
        unsettled = self._settled is not self._objects
        work = unsettled or bool(self._open or self._prefetching or self._proposing)
        return self._closed or (work and not self._answering)

    def _settle(self, objects: list[dict[str, Any]], waiting: set[int]) -> None:
        """Find clicks on other objects' fronts, and request segmentation of objects whose masks change."""
        again: list[Again] = []
        try:
            again = self._disputes.settle(objects, waiting)
        except Exception:  # clicks keep working without it
            traceback.print_exc()
        with self._changed:
            self._settled = objects
            for number, key, clicked in again if self._objects is objects else ():
                self._open.pop(number, None)  # drop its previous state
                self._disputes.draw(number, key)
                _say(object=number, key=key, again=clicked)

    def _begin(self, number: int, followed: _Followed) -> Iterator[Glimpse]:
        """Start the object's masks with the currently known clicks on others."""
        followed.prompt = replace(followed.prompt, others=self._disputes.draw(number, followed.key))
        return corrected_stream(iter(self.session.stream(followed.prompt)), followed.said)

    def _prefetch_step(self) -> None:
        assert self._prefetching is not None
        try:
            next(self._prefetching)
        except StopIteration:
            self._prefetching = None
        except Exception:  # an unreadable image is reported when it is requested
            traceback.print_exc()
            self._prefetching = None

    def _propose_step(self) -> None:
        assert self._proposing is not None
        try:
            fraction, found = next(self._proposing)
        except StopIteration:
            self._proposing = None
        except Exception as error:  # clicks keep working without proposals
            traceback.print_exc()
            self._proposing = None
            _say(proposals=[], fraction=1.0, error=f"no proposals: {error}")
        else:
            _say(proposals=[proposal_line(proposal, self.width) for proposal in found], fraction=round(fraction, 3))

    def _segment_step(self, number: int, followed: _Followed) -> None:
        found: Glimpse | None = None
        try:
            if followed.masks is None:
                followed.masks = self._begin(number, followed)
            found = next(followed.masks, None)
            said = self._shown(found) if found is not None else self._done(followed.prompt)
        except Exception as error:  # one object must not affect the others
            found, said = None, _failed(error)
        with self._changed:
            if self._open.get(number) is not followed:
                return  # superseded or cancelled meanwhile
            if found is None:
                del self._open[number]
            if found is None or found != followed.glimpsed:
                _say(object=number, key=followed.key, **said)

    def _done(self, prompt: ObjectPrompt) -> dict[str, Any]:
        panel = self.session.panel(prompt)
        box = self.session.thing_box(prompt) if panel is None else None
        measured = panel is not None or box is not None
        doubts = doubts_about(prompt, panel, box, self.capture) if measured else []
        front = self._line(prompt, panel)
        if panel is not None and front is not None:
            front["suggested"] = suggested_category(prompt, panel, self.capture)
        said = {"end": "done", "front": front, "others": others_line(prompt.others), "doubts": doubts}
        return said | {"motions": motion_lines(self.session.motions(prompt))}

    def _front(self, prompt: ObjectPrompt) -> dict[str, Any] | None:
        return self._line(prompt, self.session.panel(prompt))

    def _line(self, prompt: ObjectPrompt, panel: FrontPanel | None) -> dict[str, Any] | None:
        return front_line(panel, prompt.category, self.capture.world_from_capture) if panel is not None else None

    def _shown(self, found: Glimpse) -> dict[str, Any]:
        frame, packed, confidence = found
        share = packed.area_px / max(packed.width * packed.height, 1)
        mask = mask_bits(packed, self.width)
        return {"frame": int(frame), "confidence": round(float(confidence), 4), "area": round(share, 6), "mask": mask}


def _open_desk(workdir: Path, width: int, segmenter: str) -> Desk:
    work = Workspace(workdir)
    capture = work.load_latest("ingest", "scene")
    if capture is None:
        raise InputError("the recording has not been read yet", hint="wait for the import")
    progress = Progress(
        lambda _, fraction, text: _say(state="preparing", fraction=round(fraction, 3), text=text), stage="segment"
    )
    session = open_session(capture, work.cache, segmenter, progress=progress.part(0.0, 0.4))
    session.prepare(progress=progress.part(0.4, 1.0))
    return Desk(session, capture, width)


def _waiting(commands: Commands) -> list[dict[str, Any]] | None:
    """The next commands, without those superseded by a later one for the same object; None at the end."""
    waiting = [commands.get()]
    with contextlib.suppress(queue.Empty):
        while True:
            waiting.append(commands.get_nowait())
    if waiting[-1] is None:
        return None
    last = {_subject(command): position for position, command in enumerate(waiting) if command}
    kept = []
    for position, command in enumerate(waiting):
        if command and last[_subject(command)] == position:
            kept.append(command)
        elif command and "objects" in command:
            kept.append({"cmd": "objects", "objects": command["objects"]})
    return kept


def _subject(command: dict[str, Any]) -> int | str:
    return int(command["object"]) if "object" in command else str(command["cmd"])


def _named(error: Exception) -> R2C2RError:
    if isinstance(error, R2C2RError):
        return error
    traceback.print_exception(error)
    if isinstance(error, MemoryError):
        return memory_met()
    return R2C2RError(f"unexpected: {error}", hint="see the log of the live segmenter")


def _failed(error: Exception) -> dict[str, Any]:
    return {"end": "failed", "error": told(_named(error))}


def _read_commands(commands: Commands) -> None:
    for line in sys.stdin:
        commands.put(json.loads(line))
    commands.put(None)


def _say(**message: object) -> None:
    line = json.dumps(message) + "\n"
    with _speaking:
        sys.stdout.write(line)
        sys.stdout.flush()


if __name__ == "__main__":
    limit_this_process()
    sys.exit(main())
