"""Stand-in stage worker controlled by WORKDIR/../behave.json: `worker.py WORKDIR --until STAGE --request FILE [--only NAME …]`.

A stage that works by "objects" stores each of them; a file `hold-NAME` beside behave.json blocks the process that computes
NAME, which it announces by `at-NAME.part`, a name that no store keeps. An object whose name is in `bad.txt` fails.
"""

import json
import os
import signal
import sys
import time
import zipfile
from pathlib import Path

URDF = """<robot name="scene"><link name="world"/><link name="base"/><link name="front">
<visual><geometry><box size="0.5 0.02 0.2"/></geometry></visual>
<collision><geometry><box size="0.5 0.02 0.2"/></geometry></collision></link>
<joint name="drawer_1_base" type="fixed"><parent link="world"/><child link="base"/><origin xyz="1 2 0.5"/></joint>
<joint name="drawer_1_slide" type="prismatic"><parent link="base"/><child link="front"/><axis xyz="0 -1 0"/>
<limit lower="0" upper="0.4" effort="50" velocity="1"/></joint></robot>"""


def say(**message: object) -> None:
    sys.stdout.write(json.dumps(message) + "\n")
    sys.stdout.flush()


def work_slowly(workdir: Path, stage: str, given: Path) -> None:
    """Take a moment unless the result exists; stored content differs between computations."""
    stored = workdir / "nouns" / stage / "stand-in.noun"
    key = (given / "prompts.json").read_text() + (given / "overrides.json").read_text()
    if stored.is_file() and json.loads(stored.read_text())["key"] == key:
        return
    time.sleep(0.3)
    stored.parent.mkdir(parents=True, exist_ok=True)
    part = stored.with_suffix(".part")
    part.write_text(json.dumps({"key": key, "at": time.time_ns()}))
    part.replace(stored)


def compute_objects(workdir: Path, stage: str, given: Path, only: list[str] | None) -> list[str]:
    """Compute the missing objects, or some of them; return those left."""
    names = [item["name"] for item in json.loads((given / "prompts.json").read_text())["objects"]]
    stored = {name: workdir / "nouns" / stage / f"{name}.noun" for name in names}
    missing = [name for name in names if not stored[name].exists()]
    for name in missing if only is None else only:
        with (workdir.parent / "parts.txt").open("a") as handle:
            handle.write(f"{stage} {name} {'whole' if only is None else 'part'} {os.getpid()}\n")
        hold(workdir.parent, name, stage)
        sys.stderr.write(f"a warning about {name}\n")
        bad = workdir.parent / "bad.txt"
        if bad.exists() and name in bad.read_text():
            error = {"kind": "ObjectNotSeen", "message": f"no frame shows {name}", "hint": "click it on another frame"}
            say(error=error)
            sys.exit(1)
        stored[name].parent.mkdir(parents=True, exist_ok=True)
        part = stored[name].with_suffix(".part")
        part.write_text(f"{stage} of {name}")
        part.replace(stored[name])
    return [name for name in missing if name not in (only or ())]


def hold(project: Path, name: str, stage: str) -> None:
    """Block while the test holds the object; then end this process as told."""
    stopped: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _: stopped.append(number))
    if (project / f"hold-{name}").exists():
        written = project / f"{os.getpid()}.part"
        written.write_text(str(os.getpid()))
        written.replace(project / f"at-{name}.part")
    while (project / f"hold-{name}").exists():
        time.sleep(0.02)
        if stopped:
            say(error={"kind": "Cancelled", "message": f"{stage}: cancelled", "hint": ""})
            sys.exit(130)


def main() -> int:
    workdir, stage = Path(sys.argv[1]), sys.argv[3]
    only = sys.argv[sys.argv.index("--only") + 1 :] if "--only" in sys.argv else None
    request = Path(sys.argv[len(sys.argv) - sys.argv[::-1].index("--request")])  # the last one
    told = workdir.parent / "behave.json"
    behaviour = json.loads(told.read_text()).get(stage, "done") if told.exists() else "done"
    with (workdir.parent / "calls.txt").open("a") as handle:
        handle.write(f"{stage}\n")
    json.loads(request.read_text())
    say(stage=stage, fraction=0.5, text=f"half of {stage}")
    if behaviour == "fail":
        sys.stderr.write("a traceback that a person may want to read\n")
        say(error={"kind": "ObjectNotSeen", "message": "no frame shows drawer_1", "hint": "click it on another frame"})
        return 1
    if behaviour == "crash":
        sys.stderr.write("Segmentation fault, nearly\n")
        sys.stderr.flush()
        signal.raise_signal(signal.SIGKILL)
    left = compute_objects(workdir, stage, request.parent, only) if behaviour == "objects" else []
    if behaviour == "slow":
        work_slowly(workdir, stage, request.parent)
    if behaviour in ("hang", "deaf"):
        stopped: list[int] = []
        signal.signal(signal.SIGTERM, lambda number, _: stopped.append(number) if behaviour == "hang" else None)
        (workdir.parent / "hanging").touch()
        while not stopped:
            time.sleep(0.02)
        say(error={"kind": "Cancelled", "message": f"{stage}: cancelled", "hint": ""})
        return 130
    if stage == "export":
        stored = workdir / "nouns" / stage / "stand-in.noun"
        files = {
            "scene.glb": b"glTF" + json.dumps(json.loads((request.parent / "prompts.json").read_text())).encode(),
            "scene.urdf": URDF,
            "scene.xml": "<mujoco/>",
            "manifest.json": json.dumps({"stages": [{"name": "segment", "backend": "fake"}]}),
            "preview.png": b"png",
            "report.html": f"<h1>report</h1>{stored.read_text() if stored.is_file() else ''}",  # as a bundle shows its nouns
            "review.html": "<script>1</script>",
            "report.json": json.dumps({"certificate": {"passed": True, "findings": [], "drift_m": 0.001}}),
        }
        with zipfile.ZipFile(workdir / "bundle.zip", "w") as archive:
            for name, content in files.items():
                archive.writestr(zipfile.ZipInfo(name), content)  # without the time, as a bundle is reproducible
    say(done=stage, computed=[], failures={}, passed=True, left=left)
    if behaviour == "lingers":
        time.sleep(600)
    return 0


if __name__ == "__main__":
    sys.exit(main())
