"""A stage worker that does what WORKDIR/../behave.json says: `worker.py WORKDIR --until STAGE --request FILE`."""

import json
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
    """Take a moment, unless the same was done before; what is stored tells two doings apart."""
    stored = workdir / "nouns" / stage / "stand-in.noun"
    key = (given / "prompts.json").read_text() + (given / "overrides.json").read_text()
    if stored.is_file() and json.loads(stored.read_text())["key"] == key:
        return
    time.sleep(0.3)
    stored.parent.mkdir(parents=True, exist_ok=True)
    part = stored.with_suffix(".part")
    part.write_text(json.dumps({"key": key, "at": time.time_ns()}))
    part.replace(stored)


def main() -> int:
    workdir, stage, request = Path(sys.argv[1]), sys.argv[3], Path(sys.argv[5])
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
        with zipfile.ZipFile(workdir / "bundle.zip", "w") as archive:
            archive.writestr(
                "scene.glb", b"glTF" + json.dumps(json.loads((request.parent / "prompts.json").read_text())).encode()
            )
            archive.writestr("scene.urdf", URDF)
            archive.writestr("manifest.json", json.dumps({"stages": [{"name": "segment", "backend": "fake"}]}))
            archive.writestr("preview.png", b"png")
            archive.writestr("report.html", "<h1>report</h1>")
            archive.writestr("review.html", "<script>1</script>")
            archive.writestr("report.json", json.dumps({"certificate": {"passed": True, "findings": [], "drift_m": 0.001}}))
    say(done=stage, computed=[], failures={}, passed=True)
    if behaviour == "lingers":
        time.sleep(600)
    return 0


if __name__ == "__main__":
    sys.exit(main())
