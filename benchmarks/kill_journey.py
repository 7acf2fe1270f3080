"""Simulated user from upload to download while servers are killed, with a check that acknowledged changes are still stored."""

import contextlib
import hashlib
import io
import json
import random
import zipfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx2 as httpx
from kill_server import SetUp
from waiting import PATIENCE, until

PIECES = 12  # number of parts that a recording is uploaded in


class Refused(Exception):
    """The server answered with an error."""

    def __init__(self, status: int, message: str) -> None:
        super().__init__(f"{status}: {message}")
        self.status, self.message = status, message


@dataclass(frozen=True)
class Change:
    """A pending change: the same request is repeated under the same key until a response arrives."""

    what: str
    method: str
    path: str
    body: Any
    key: str
    took: Callable[[Any], None]  # applies the response to the expected state


class Journey:
    """One simulated user, and everything that the server acknowledged."""

    def __init__(self, server: SetUp, rng: random.Random, real: Path | None) -> None:
        self.server, self.rng, self.real = server, rng, real
        self.client = httpx.Client(timeout=60 * PATIENCE, follow_redirects=True)  # bundles are at the store
        self.recording = (real / "scan.r3d").read_bytes() if real else _any_zip()
        self.upload: tuple[str, int] | None = None  # id, acknowledged bytes
        self.project, self.ready, self.stood_in = "", False, False
        self.frames: list[dict[str, Any]] = []
        self.objects: dict[int, dict[str, Any]] = {}
        self.reviews: dict[int, dict[str, Any]] = {}  # groups, as last acknowledged
        self.comments: dict[int, dict[str, Any]] = {}
        self.state = "draft"
        self.jobs: set[int] = set()
        self.bundles: dict[int, str] = {}  # version: checksum
        self.part: tuple[int, bytes] | None = None  # of a bundle being downloaded
        self.pending: Change | None = None
        self.acknowledged, self.sent_again, self.job_ends = Counter[str](), Counter[str](), Counter[str]()
        self.lost: list[str] = []

    @property
    def at(self) -> str:
        """The project's address."""
        return f"/api/projects/{self.project}"

    def ask(self, method: str, path: str, **options: Any) -> Any:
        """One request; raises httpx.HTTPError if the server dies during it, Refused if it returns an error."""
        headers = {"X-Requested-With": "kills", "Host": self.server.host, **options.pop("headers", {})}
        answer = self.client.request(method, self.server.address_for(path) + path, headers=headers, **options)
        if answer.status_code >= 500 and answer.status_code != 503 and not answer.history:
            self.lost.append(f"{method} {path}: {answer.status_code} {answer.text[:200]}")
        if answer.status_code >= 400:
            raise Refused(answer.status_code, answer.text[:200])
        return answer.json() if answer.content and "json" in answer.headers["content-type"] else answer

    def change(self, what: str, method: str, path: str, body: Any, took: Callable[[Any], None]) -> None:
        """Send one change; it stays pending if the server dies before it responds."""
        self.pending = Change(what, method, path, body, f"{self.rng.getrandbits(96):x}", took)
        self._send(self.pending)

    def send_again(self) -> None:
        """Repeat the change whose response was lost, under the same key."""
        change = self.pending
        if change is None:
            return
        try:
            self._send(change)
            self.sent_again["answered"] += 1
        except Refused as refused:
            if "is stored" not in refused.message:
                return
            self.sent_again["stored, not answered before"] += 1
            self._read_again(change)

    def sign_in(self) -> None:
        """Sign in; the session survives server restarts."""
        self.client.get(f"{self.server.address_for('/')}/", params={"token": "key"})

    def act(self) -> None:
        """Do the next action; a pending change is resolved first."""
        with contextlib.suppress(Refused):
            if self.pending is not None:
                self.send_again()
            elif not self.project:
                self._import()
            elif not self.ready:
                self._open()
            else:
                self.rng.choice(self._choices())()

    def compare(self) -> None:
        """Check that exactly the acknowledged state is stored."""
        self._compare_upload()
        if not self.ready:
            return
        now = {item["id"]: item for item in self.ask("GET", f"{self.at}/objects?deleted=true")}
        self._expect("objects", set(now) == set(self.objects), f"{sorted(self.objects)} acknowledged, {sorted(now)} found")
        for number, said in self.objects.items():
            found = now.get(number, {})
            differs = [key for key in ("name", "category", "points", "deleted") if found.get(key) != said[key]]
            self._expect(f"object {number}", not differs, f"{differs}: {said} acknowledged, {found} found")
        self._compare_review()

    def settles(self, seconds: float) -> bool:
        """Whether every job and every object's masks finish without further requests."""

        def quiet() -> bool:
            jobs = self.ask("GET", f"/api/jobs?project={self.project}&limit=500")
            busy = [job for job in jobs if job["state"] in ("queued", "running", "cancelling")]
            lanes = self.ask("GET", f"{self.at}/lanes")
            return not busy and all(lane["state"] not in ("waiting", "running", "partial") for lane in lanes)

        with contextlib.suppress(TimeoutError):
            until(lambda: self.ready or self.act() or self.ready, 120)
            until(quiet, seconds)
            jobs = {job["id"]: job for job in self.ask("GET", f"/api/jobs?project={self.project}&limit=500")}
            self._expect("jobs", self.jobs <= set(jobs), f"{self.jobs - set(jobs)} acknowledged, not found")
            self.job_ends.update(job["state"] for job in jobs.values())
            gave_up = [f"{job['id']}: {job['error']}" for job in jobs.values() if job["state"] == "failed"]
            self._expect("jobs", not gave_up, f"{gave_up} gave up")
            return True
        return False

    def _choices(self) -> list[Callable[[], None]]:
        """The currently possible actions, repeated in proportion to how frequent they are in use."""
        there = [number for number, item in self.objects.items() if not item["deleted"]]
        review = [self._comment, self._resolve, self._step, self._download, self._run]
        judged = [number for number in self.reviews if number in there]
        if judged:
            of = self.rng.choice(judged)
            review += [lambda: self._judge(of)] * 3 + [lambda: self._correct(of)] * (1 if self.real else 2)
        if self.real:  # a click at a random place would add an object to reconstruct
            return review
        number = self.rng.choice([n for n in self.objects if n not in self.reviews] or [0])  # a deleted one may be undone
        edits = [self._change_side_upload] + [self._add] * (2 if len(there) < 9 else 0)
        edits += [lambda: self.change("undo", "POST", f"{self.at}/undo", {"object": number}, self._took_undone)] * 2
        if number in there:
            edits += [lambda: self._edit(number, "POST", "/points", self._click())] * 4
            edits += [lambda: self._edit(number, "PATCH", "", {"category": self.rng.choice(["drawer", "oven", "mug"])})]
            edits += [lambda: self._edit(number, "DELETE", "", None)]
        return review + edits

    def _import(self) -> None:
        """Upload in parts, then finish."""
        if self.upload is None:
            wish = {"file_name": "scan.r3d", "size": len(self.recording)}
            self.upload = (self.ask("POST", "/api/uploads", json=wish)["id"], 0)
        number, offset = self.upload
        if offset < len(self.recording):
            self._send_piece(number, offset, self.recording, len(self.recording) // PIECES + 1)
            return
        self.project = self.ask("POST", f"/api/uploads/{number}/finish")["id"]
        self.upload = None
        self.acknowledged["recording"] += 1

    def _send_piece(self, number: str, offset: int, content: bytes, length: int) -> None:
        piece, headers = content[offset : offset + length], {"Upload-Offset": str(offset)}
        answer = self.ask("PATCH", f"/api/uploads/{number}", content=piece, headers=headers)
        self.upload = (number, int(answer.headers["upload-offset"]))
        self.acknowledged["piece of a recording"] += 1

    def _change_side_upload(self) -> None:
        """Continue another upload, which is never completed."""
        if self.upload is None:
            self.upload = (self.ask("POST", "/api/uploads", json={"file_name": "next.zip", "size": 1 << 20})["id"], 0)
        self._send_piece(*self.upload, bytes(1 << 20), 64)

    def _open(self) -> None:
        """Once the import is done: create the objects, and (with stand-in stages) the nouns of a first reconstruction."""
        project = self.ask("GET", self.at)
        if project["status"] != "ready":
            return
        self.frames = self.ask("GET", f"{self.at}/frames")
        if self.real is not None:
            prompts = json.loads((self.real / "prompts.json").read_text())
            first = {**prompts, "objects": prompts["objects"][:3]}
            self.ask("POST", f"{self.at}/prompts.json", json=first)  # keyed by name, so repeating it is harmless
            self._run()
        elif not self.stood_in:
            self._stand_in_for_a_first_run()
        self.objects = {item["id"]: item for item in self.ask("GET", f"{self.at}/objects?deleted=true")}
        self.reviews = {group["object"]: group for group in self.ask("GET", f"{self.at}/candidates")}
        self.ready = True

    def _stand_in_for_a_first_run(self) -> None:
        from tests.app.nouns import finish

        clicks = [{**self._click(), "label": 1}]
        drawer = {"name": "drawer_1", "category": "drawer", "points": clicks}
        self.ask("POST", f"{self.at}/prompts.json", json={"version": 1, "objects": [drawer]})
        stages = ("segment", "generate", "align", "export")
        with self.server.writing(self.project) as folder:
            finish(folder / "work")
            (folder / "behave.json").write_text(json.dumps(dict.fromkeys(stages, "slow")))
        self.stood_in = True

    def _add(self) -> None:
        body = {"category": self.rng.choice(["drawer", "cabinet", "mug"]), "points": [self._click()]}
        self.change("object", "POST", f"{self.at}/objects", body, self._took_object)

    def _edit(self, number: int, method: str, path: str, body: Any) -> None:
        self.change("click or edit", method, f"{self.at}/objects/{number}{path}", body, self._took_object)

    def _click(self) -> dict[str, Any]:
        frame = self.rng.choice(self.frames)
        # the stand-in segmenter blocks on clicks at the right edge: their masks never finish
        x, y = self.rng.uniform(0, 0.95 * frame["width"]), self.rng.uniform(0, frame["height"] - 1)
        return {"frame": frame["index"], "x": x, "y": y, "label": 1}

    def _judge(self, number: int) -> None:
        candidate = self.rng.choice(self.reviews[number]["candidates"])["id"]
        verdict = self.rng.choice(["accepted", "accepted", "cleared"] if self.real else ["accepted", "rejected", "cleared"])
        reason = f"because {self.rng.randrange(1000)}"
        body = {"candidate": candidate, "verdict": verdict, "reason": reason, "rerun": not self.real}
        self.change("verdict", "POST", f"{self.at}/objects/{number}/verdicts", body, self._took_review)

    def _correct(self, number: int) -> None:
        body = {"hinge": self.rng.choice(["left", "right", None]), "rerun": self.rng.random() < 0.5}
        self.change("correction", "PATCH", f"{self.at}/objects/{number}/override", body, self._took_review)

    def _comment(self) -> None:
        body = {"text": f"look at {self.rng.randrange(10**6)}"}
        self.change("comment", "POST", f"{self.at}/comments", body, self._took_comment)

    def _resolve(self) -> None:
        if self.comments:
            comment = self.rng.choice(list(self.comments.values()))
            body = {"resolved": comment["resolved_at"] is None}
            self.change("comment", "PATCH", f"{self.at}/comments/{comment['id']}", body, self._took_comment)

    def _step(self) -> None:
        moves = self.ask("GET", f"{self.at}/review")["moves"]
        body = {"from_state": self.state, "to": self.rng.choice(moves)["to"], "reason": "it is time"}
        self.change("review step", "POST", f"{self.at}/review", body, self._took_state)

    def _run(self) -> None:
        self.change("run", "POST", f"{self.at}/run", {}, lambda job: self.jobs.add(job["id"]))

    def _download(self) -> None:
        """Download half of a bundle now, the other half later, perhaps from another server."""
        if self.part is None:
            found = self.ask("GET", f"{self.at}/bundles")
            self.bundles.update({bundle["version"]: bundle["sha256"] for bundle in found})
            if found:
                version, size = found[0]["version"], found[0]["size"]
                self.part = (version, self._range(version, f"0-{size // 2}"))
            return
        version, half = self.part
        whole = half + self._range(version, f"{len(half)}-")
        self._expect("download", hashlib.sha256(whole).hexdigest() == self.bundles[version], f"bundle {version} differs")
        self.part = None
        self.acknowledged["download"] += 1

    def _range(self, version: int, wanted: str) -> bytes:
        answer = self.ask("GET", f"/media/{self.project}/bundles/{version}.zip", headers={"Range": f"bytes={wanted}"})
        return bytes(answer.content)

    def _took_object(self, item: dict[str, Any]) -> None:
        self.objects[item["id"]] = item

    def _took_undone(self, undone: dict[str, Any]) -> None:
        self._took_object(undone["object"])

    def _took_review(self, reviewed: dict[str, Any]) -> None:
        if reviewed["group"] is not None:
            self.reviews[reviewed["group"]["object"]] = reviewed["group"]
        if reviewed["job"] is not None:
            self.jobs.add(reviewed["job"]["id"])

    def _took_comment(self, comment: dict[str, Any]) -> None:
        self.comments[comment["id"]] = comment

    def _took_state(self, status: dict[str, Any]) -> None:
        self.state = status["state"]

    def _send(self, change: Change) -> None:
        try:
            answer = self.ask(change.method, change.path, json=change.body, headers={"Idempotency-Key": change.key})
        except Refused as refused:
            if refused.status != 503 and "is stored" not in refused.message:
                self.pending = None
            raise
        change.took(answer)
        self.acknowledged[change.what] += 1
        self.pending = None

    def _read_again(self, change: Change) -> None:
        """Re-read the result of a change that was stored but never answered."""
        self.pending = None
        self.acknowledged[change.what] += 1
        if change.what in ("object", "click or edit", "undo"):
            for item in self.ask("GET", f"{self.at}/objects?deleted=true"):
                self._took_object(item)
        elif change.what in ("verdict", "correction"):
            self.reviews = {group["object"]: group for group in self.ask("GET", f"{self.at}/candidates")}
        elif change.what == "comment":
            self.comments = {comment["id"]: comment for comment in self.ask("GET", f"{self.at}/comments")}
        elif change.what == "review step":
            self._took_state(self.ask("GET", f"{self.at}/review"))

    def _compare_upload(self) -> None:
        if self.upload is None:
            return
        number, acknowledged = self.upload
        try:
            length = int(self.ask("HEAD", f"/api/uploads/{number}").headers["upload-offset"])
        except Refused:  # already a project: the response to finishing was lost, and it was requested again
            length = len(self.recording) if not self.project else 0
        self._expect("upload", length >= acknowledged, f"{acknowledged} bytes acknowledged, {length} found")
        self.upload = (number, length)

    def _compare_review(self) -> None:
        groups = {group["object"]: group for group in self.ask("GET", f"{self.at}/candidates")}
        for number, said in self.reviews.items():
            found = groups.get(number)
            if found is None:
                self._expect(f"object {number}", self.objects[number]["deleted"], "its candidates are gone")
                continue
            self._expect(
                f"review of {number}", _said(found) == _said(said), f"{said['version']} acknowledged, {found['version']} found"
            )
        if self.real:
            self.reviews = groups
        now = {comment["id"]: comment for comment in self.ask("GET", f"{self.at}/comments")}
        self._expect("comments", now == self.comments, f"{len(self.comments)} acknowledged, {len(now)} found, or changed")
        state = self.ask("GET", f"{self.at}/review")["state"]
        self._expect("state", state == self.state, f"{self.state} acknowledged, {state} found")
        kept = {bundle["version"]: bundle["sha256"] for bundle in self.ask("GET", f"{self.at}/bundles")}
        self._expect("bundles", self.bundles.items() <= kept.items(), f"{self.bundles} seen, {kept} found")

    def _expect(self, what: str, holds: bool, said: str) -> None:
        if not holds:
            self.lost.append(f"{what}: {said}")


def _said(group: dict[str, Any]) -> tuple[Any, ...]:
    """The fields of an object's group that people set."""
    return group["version"], group["override"], {c["id"]: (c["verdict"], c["verdict_reason"]) for c in group["candidates"]}


def _any_zip() -> bytes:
    """A zip that the import's stand-in accepts."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("metadata", b"{}")
        archive.writestr("noise", random.Random(0).randbytes(40_000))
    return buffer.getvalue()
