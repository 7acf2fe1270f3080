"""The `r2c2r` command: thin over the pipeline, the stages and the app.

Exit codes: 0 done, 1 the work failed or a check fell short, 2 wrong usage or unreadable input. Errors are one line on
stderr; a traceback only with --debug. Results go to stdout, progress to stderr.
"""

import argparse
import getpass
import importlib
import json
import os
import shutil
import sys
import tempfile
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from r2c2r_core import __version__
from r2c2r_core.errors import CaptureError, InputError, R2C2RError
from r2c2r_core.terminal import certificate_text, show_progress, table

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: on small matrices its threads double the CPU bill

Command = Callable[[argparse.Namespace], int]


def main(arguments: Sequence[str] | None = None) -> int:
    """Parse, run one command, and turn failures into one line and an exit code."""
    options = _parser().parse_args(arguments)
    command: Command = options.command
    try:
        return command(options)
    except R2C2RError as error:
        if options.debug:
            traceback.print_exc()
        print(f"r2c2r: {' '.join(str(error).split())}", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        print("r2c2r: stopped; finished stages are kept, the same command goes on", file=sys.stderr)
        return 1
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # the reader of our output left; say no more
        return 1
    except OSError as error:
        if options.debug:
            traceback.print_exc()
        where = error.filename or "input/output"
        print(f"r2c2r: {where}: {error.strerror or error}; free some space or choose another folder", file=sys.stderr)
        return 1


def run(options: argparse.Namespace) -> int:
    """Headless reconstruction: recording and prompts in, certified bundle out."""
    from r2c2r_core.config import ReconstructConfig, read_config
    from r2c2r_core.disk import explained_io
    from r2c2r_core.overrides import NO_OVERRIDES, read_overrides
    from r2c2r_core.pipeline import Request, Tools, reconstruct, restricted_licences
    from r2c2r_core.segment.prompts import read_prompts
    from r2c2r_core.workspace import Workspace

    destination: Path = options.output
    if destination.suffix != ".zip":
        raise InputError(f"{destination}: not a .zip", hint="name the bundle, such as -o kitchen.zip")
    request = Request(
        source=_existing(options.capture),
        prompts=read_prompts(options.prompts),
        overrides=read_overrides(options.overrides) if options.overrides else NO_OVERRIDES,
        config=read_config(options.config) if options.config else ReconstructConfig(),
        tools=Tools(**_given(options, "segmenter", "generator", "matcher")),
        seed=options.seed,
    )
    for line in restricted_licences(request.tools):
        print(f"r2c2r: {line}", file=sys.stderr)
    work = Workspace(options.workdir or destination.with_suffix(".work"))
    with show_progress() as progress:
        outcome = reconstruct(request, work, progress=progress)
    assert outcome.reconstruction is not None
    assert outcome.certificate is not None
    with explained_io(destination):
        destination.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(work.bundle, destination)
    if options.masks:
        _write_masks(outcome.reconstruction, options.masks)
    if not outcome.computed:
        print("nothing changed: every stage was reused")
    print(_summary(outcome.reconstruction))
    for name, reason in outcome.failures.items():
        print(f"r2c2r: {name} is not in the bundle: {reason}", file=sys.stderr)
    print(f"{destination}: certificate {'passed' if outcome.certificate.passed else 'FAILED'}")
    return 0 if outcome.certificate.passed and not outcome.failures else 1


def sample(options: argparse.Namespace) -> int:
    """Write a synthetic kitchen recording with exact truth."""
    from r2c2r_core.disk import explained_io
    from r2c2r_core.synthetic.stage import write_sample

    with show_progress() as progress, explained_io(options.out):
        paths = write_sample(
            options.out,
            seed=options.seed,
            frames=options.frames,
            size=options.size,
            opened=options.opened,
            progress=progress.for_stage("sample"),
        )
    print(f"{paths.scan}  {paths.truth}  {paths.prompts}")
    return 0


def info(options: argparse.Namespace) -> int:
    """The capture doctor."""
    from r2c2r_core.ingest.doctor import draw_scan, examine, refusal_to_json
    from r2c2r_core.ingest.readers.table import open_recording
    from r2c2r_core.ingest.stage import IngestConfig, read_capture
    from r2c2r_core.overrides import read_overrides

    source = _existing(options.capture)
    overrides = read_overrides(options.overrides) if options.overrides else None
    with tempfile.TemporaryDirectory(prefix="r2c2r-info-") as store, show_progress() as progress:
        reading = progress.for_stage("ingest")
        try:
            capture = read_capture(source, Path(store), IngestConfig(), overrides=overrides, progress=reading)
        except CaptureError as problem:
            if options.json:
                _write_json(options.json, refusal_to_json(problem))
            raise
        report = examine(capture, open_recording(source))
    if options.json:
        _write_json(options.json, report.to_json())
    if options.picture:
        _write_picture(options.picture, draw_scan(capture))
    print(table(("figure", "value"), report.rows()))
    for line in (*report.reasons, *report.notices):
        print(f"- {line}")
    print(f"{source}: {report.verdict}")
    return 1 if report.verdict == "unusable" else 0


def check(options: argparse.Namespace) -> int:
    """Lint and simulation certificate of a bundle."""
    from r2c2r_core.export.stage import certificate_to_json, check_bundle

    with show_progress() as progress:
        certificate = check_bundle(_existing(options.bundle), progress=progress.for_stage("check"))
    if options.json:
        _write_json(options.json, certificate_to_json(certificate))
    print(certificate_text(certificate))
    return 0 if certificate.passed else 1


def evaluate(options: argparse.Namespace) -> int:
    """The metric set against truth: of a bundle, or of a dataset that `r2c2r dataset` wrote (its masks and aligned meshes)."""
    from r2c2r_core.evaluate.dataset import evaluate_dataset, is_dataset
    from r2c2r_core.evaluate.stage import evaluate_bundle

    bundle, truth = _existing(options.bundle), _existing(options.truth)
    dataset = is_dataset(bundle)
    evaluation = evaluate_dataset(bundle, truth) if dataset else evaluate_bundle(bundle, truth, masks=options.masks)
    if options.json:
        _write_json(options.json, evaluation.to_json())
    print(evaluation.to_text())
    return 0


def dataset(options: argparse.Namespace) -> int:
    """A finished work folder as a dataset: labelled frames, candidate meshes, matched points, aligned meshes (paper §3)."""
    from r2c2r_core.dataset.stage import LabelledObject, StoredFrames, write_dataset
    from r2c2r_core.disk import explained_io
    from r2c2r_core.ingest.store import depth_path, rgb_path
    from r2c2r_core.workspace import Workspace

    workdir = _existing(options.workdir)
    if not (workdir / "nouns").is_dir():
        raise InputError(f"{workdir}: not a work folder", hint="give the --workdir of r2c2r run")
    work = Workspace(workdir)
    capture = work.load_latest("ingest", "scene")
    if capture is None:
        raise InputError(f"{workdir}: no recording was read here", hint="run r2c2r run with this --workdir first")
    objects = [
        LabelledObject(track, work.load_latest("generate", name), work.load_latest("align", name))
        for name in work.names("segment")
        if (track := work.load_latest("segment", name)) is not None
    ]
    stored = StoredFrames(lambda index: rgb_path(work.frames, index), lambda index: depth_path(work.frames, index))
    with show_progress() as progress, explained_io(options.output):
        manifest = write_dataset(capture, objects, stored, options.output, progress=progress.for_stage("dataset"))
    placed = sum((options.output / "objects" / item.track.name / "aligned.glb").exists() for item in objects)
    print(f"{manifest}: {len(objects)} objects, {placed} of them placed")
    return 0


def doctor(options: argparse.Namespace) -> int:
    """Backends, extras, weights, GPU, ports, free disk."""
    from r2c2r_core.doctor import examine_machine

    findings = examine_machine(options.data)
    if options.json:
        _write_json(options.json, {"version": 1, "findings": [f.to_json() for f in findings]})
    print(table(("what", "state", "detail"), [(f.what, f.state, f.detail) for f in findings]))
    return 1 if any(f.state == "problem" for f in findings) else 0


def serve(options: argparse.Namespace) -> int:
    """The web app."""
    limits = {"heavy_jobs": options.jobs, "max_upload_bytes": options.max_upload * 2**30}
    _web("serve").serve(host=options.host, port=options.port, data_dir=options.data, names=options.name, **limits)
    return 0


def user(options: argparse.Namespace) -> int:
    """Accounts of the people who may sign in: add, list, role, password, remove."""
    users, data, name = _web("users"), options.data, getattr(options, "name", "")
    if options.what == "list":
        print(table(("name", "role"), users.everyone(data)))
    elif options.what == "add":
        users.add(data, name, options.role, _password())
    elif options.what == "role":
        users.set_role(data, name, options.role)
    elif options.what == "password":
        users.set_password(data, name, _password())
    elif options.what == "remove":
        users.remove(data, name)
    return 0


def demo(options: argparse.Namespace) -> int:
    """Sample kitchen, pipeline, certified bundle, and the app opened on it."""
    folder: Path = options.data / "demo"
    scan = folder / "sample" / "scan.r3d"
    if not scan.exists():
        code = main(["sample", str(scan.parent), "--frames", str(options.frames), "--size", "{}x{}".format(*options.size)])
        if code:
            return code
    bundle = folder / "kitchen.zip"
    prompts = scan.with_name("prompts.json")
    code = main(["run", str(scan), "--prompts", str(prompts), "-o", str(bundle), "--workdir", str(folder / "work")])
    if code or options.no_serve:
        return code
    web = _web("serve")
    project = web.register_finished(options.data, name="Sample kitchen", source=scan, prompts=prompts, workdir=folder / "work")
    web.serve(host=options.host, port=options.port, data_dir=options.data, open_project=project)
    return 0


def _web(module: str) -> Any:
    """A module of the web half, by name: the core never imports it (architecture: never r2c2r_core -> app)."""
    return importlib.import_module(f"app.{module}")


def _password() -> str:
    """Asked for twice on a terminal, else the first line of standard input."""
    if not sys.stdin.isatty():
        return sys.stdin.readline().rstrip("\n")
    password = getpass.getpass("password: ")
    if getpass.getpass("once more: ") != password:
        raise InputError("the two passwords differ", hint="try again")
    return password


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="r2c2r", description="One RGB-D scan of a kitchen in, a scene that opens out.")
    parser.add_argument("--version", action="version", version=f"r2c2r {__version__}")
    parser.add_argument("--debug", action="store_true", help="show the traceback of an error")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    def add(name: str, command: Command) -> argparse.ArgumentParser:
        text = (command.__doc__ or "").strip()
        added = commands.add_parser(name, help=text, description=text)
        added.set_defaults(command=command)
        added.add_argument("--debug", action="store_true", default=argparse.SUPPRESS, help=argparse.SUPPRESS)
        return added

    data = Path(os.environ.get("R2C2R_DATA", Path.home() / ".local" / "share" / "r2c2r"))
    for name, command in (("serve", serve), ("demo", demo)):
        web = add(name, command)
        web.add_argument("--host", default="127.0.0.1")
        web.add_argument("--port", type=int, default=8000)
        web.add_argument("--data", type=Path, default=data, help="folder of the projects (default: %(default)s)")
        if name == "serve":
            web.add_argument("--jobs", type=_positive, default=1, help="heavy jobs at a time (default: %(default)s)")
            web.add_argument("--max-upload", type=_positive, default=16, metavar="GB", help="default: %(default)s")
            web.add_argument("--name", action="append", default=[], metavar="HOST", help="another name people reach it by")
        if name == "demo":
            web.add_argument("--no-serve", action="store_true", help="stop after the bundle is written")
            _add_size(web)
    _add_user(add("user", user), data)
    sampled = add("sample", sample)
    sampled.add_argument("out", type=Path)
    sampled.add_argument("--seed", type=int, default=0)
    sampled.add_argument("--opened", action="store_true", help="a drawer and a door stand open in the later frames")
    _add_size(sampled)
    examined = add("info", info)
    examined.add_argument("capture", type=Path)
    examined.add_argument("--overrides", type=Path, help="what a person said about the room: up, floor, manhattan_yaw, walls")
    examined.add_argument("--json", type=Path)
    examined.add_argument("--picture", type=Path, metavar="FILE.png", help="the fused scan and the camera's path, drawn")
    ran = add("run", run)
    ran.add_argument("capture", type=Path)
    ran.add_argument("--prompts", type=Path, required=True)
    ran.add_argument("-o", "--output", type=Path, required=True, metavar="BUNDLE.zip")
    ran.add_argument("--workdir", type=Path, help="where stages are kept (default: beside the bundle)")
    ran.add_argument("--overrides", type=Path)
    ran.add_argument("--config", type=Path)
    for seam in ("segmenter", "generator", "matcher"):
        ran.add_argument(f"--{seam}")
    ran.add_argument("--seed", type=int, default=0)
    ran.add_argument("--masks", type=Path, help="write DIR/<object>/<frame:06d>.png")
    checked = add("check", check)
    checked.add_argument("bundle", type=Path)
    checked.add_argument("--json", type=Path)
    evaluated = add("evaluate", evaluate)
    evaluated.add_argument("bundle", type=Path, help="a bundle (zip or folder), or a dataset's folder")
    evaluated.add_argument("--truth", type=Path, required=True)
    evaluated.add_argument("--masks", type=Path, help="the folder that run --masks wrote")
    evaluated.add_argument("--json", type=Path)
    collected = add("dataset", dataset)
    collected.add_argument("workdir", type=Path, help="the --workdir of r2c2r run, or a project's work folder")
    collected.add_argument("-o", "--output", type=Path, required=True, metavar="DIR")
    machine = add("doctor", doctor)
    machine.add_argument("--data", type=Path, default=data)
    machine.add_argument("--json", type=Path)
    return parser


def _add_user(parser: argparse.ArgumentParser, data: Path) -> None:
    actions = parser.add_subparsers(required=True, dest="what", metavar="add|list|role|password|remove")
    for what in ("add", "list", "role", "password", "remove"):
        action = actions.add_parser(what)
        action.add_argument("--data", type=Path, default=data, help="folder of the projects (default: %(default)s)")
        if what != "list":
            action.add_argument("name")
        if what == "add":
            action.add_argument("--role", default="annotator", help="annotator, reviewer or admin (default: %(default)s)")
        if what == "role":
            action.add_argument("role", help="annotator, reviewer or admin")


def _add_size(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--frames", type=_positive, default=180)
    parser.add_argument("--size", type=_size, default=(960, 720), metavar="WxH")


def _positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text}: expected a positive number")
    return value


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.lower().partition("x")
    if not (width.isdigit() and height.isdigit() and int(width) >= 64 and int(height) >= 64):
        raise argparse.ArgumentTypeError(f"{text}: expected WIDTHxHEIGHT, such as 960x720")
    return int(width), int(height)


def _existing(path: Path) -> Path:
    if not path.exists():
        raise InputError(f"{path}: no such file or folder", hint="check the path")
    return path


def _given(options: argparse.Namespace, *names: str) -> dict[str, str]:
    return {name: getattr(options, name) for name in names if getattr(options, name) is not None}


def _write_json(path: Path, document: dict[str, Any]) -> None:
    from r2c2r_core.workspace import write_atomically

    write_atomically(path, (json.dumps(document, indent=1) + "\n").encode())


def _write_picture(path: Path, pictures: Any) -> None:
    import cv2

    from r2c2r_core.ingest.doctor import side_by_side
    from r2c2r_core.workspace import write_atomically

    write_atomically(path, cv2.imencode(".png", cv2.cvtColor(side_by_side(pictures), cv2.COLOR_RGB2BGR))[1].tobytes())


def _write_masks(reconstruction: Any, folder: Path) -> None:
    import cv2
    import numpy as np

    from r2c2r_core.geometry.masks import unpack_mask
    from r2c2r_core.workspace import write_atomically

    for track in reconstruction.tracks:
        for frame_index, packed in track.masks.items():
            png = cv2.imencode(".png", unpack_mask(packed).astype(np.uint8) * 255)[1]
            write_atomically(folder / track.name / f"{frame_index:06d}.png", png.tobytes())


def _summary(reconstruction: Any) -> str:
    """Object, category, dimensions, joint, mask frames, placement rms, warnings."""
    tracks = {track.name: track for track in reconstruction.tracks}
    placements = {placement.object_name: placement for placement in reconstruction.placements}
    rows = []
    for item in reconstruction.scene.objects:
        width, depth, height = (f"{100 * size:.1f}" for size in item.dimensions_m)
        joints = ", ".join(f"{joint.type} {joint.upper:.2f}" for joint in item.joints) or "-"
        placement = placements.get(item.name)
        rms = f"{1000 * placement.rms_m:.1f}" if placement else "-"
        warnings = "; ".join(item.warnings + (placement.warnings if placement else ()))
        frames = len(tracks[item.name].masks) if item.name in tracks else 0
        rows.append((item.name, item.category, f"{width} x {depth} x {height}", joints, str(frames), rms, warnings))
    return table(("object", "category", "w x d x h cm", "joint", "masks", "rms mm", "warnings"), rows)


if __name__ == "__main__":
    sys.exit(main())
