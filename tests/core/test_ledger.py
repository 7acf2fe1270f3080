"""Resumption of runs: recomputed and reused results."""

import errno
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import cv2
import numpy as np
import pytest

from r2c2r_core.align.stage import Placer
from r2c2r_core.disk import explained_io
from r2c2r_core.errors import BackendUnavailable, Cancelled, EnvironmentProblem, ObjectNotSeen
from r2c2r_core.geometry.masks import PackedMask, pack_mask
from r2c2r_core.ledger import Kept, Ledger, Reached, Stage
from r2c2r_core.model.inputs import FrameSaid, ObjectPrompt
from r2c2r_core.progress import SILENT, Progress
from r2c2r_core.tuning import Changes, changed, tuning
from r2c2r_core.workspace import Workspace, content_key, file_key, write_atomically


def noun(area: int) -> PackedMask:
    return PackedMask(height=1, width=1, left=0, top=0, box_width=0, box_height=0, bits=b"", area_px=area)


def run(root: Path, areas: dict[str, int]) -> Workspace:
    work = Workspace(root)
    ledger = Ledger(work, SILENT)
    items = {name: Kept(area, content_key(area)) for name, area in areas.items()}
    ledger.each("segment", lambda area, progress: noun(area), items, items)
    return work


def test_a_second_run_with_equal_inputs_recomputes_nothing(tmp_path: Path) -> None:
    assert run(tmp_path, {"a": 1, "b": 2}).computed == ["segment/a", "segment/b"]
    assert run(tmp_path, {"a": 1, "b": 2}).computed == []


def test_a_changed_prompt_recomputes_only_its_object(tmp_path: Path) -> None:
    run(tmp_path, {"a": 1, "b": 2})
    assert run(tmp_path, {"a": 1, "b": 3}).computed == ["segment/b"]


def test_a_changed_pixel_in_a_painted_mask_recomputes_the_object(tmp_path: Path) -> None:
    def computed(mask: np.ndarray) -> list[str]:
        said = (FrameSaid(frame=0, mask=pack_mask(mask)),)
        prompt = ObjectPrompt(name="a", category="drawer", points=(), frames=said)
        work = Workspace(tmp_path)
        Ledger(work, SILENT).each("segment", lambda prompt, progress: noun(1), ["a"], {"a": prompt})
        return work.computed

    painted = np.zeros((8, 8), dtype=bool)
    painted[[1, 6], [1, 6]] = True
    other = painted.copy()
    other[3, 3] = True  # in the same box: only the bits differ
    assert computed(painted) == ["segment/a"]
    assert computed(painted) == []
    assert computed(other) == ["segment/a"]


def test_the_code_of_an_object_passed_to_a_stage_determines_its_results(tmp_path: Path) -> None:
    """Candidates are ranked by a Placer of another package, whose numbers then apply; without it they do not."""

    def computed(work: str, placer: Placer | None, numbers: Changes) -> list[str]:
        kept = Workspace(tmp_path / work)
        with tuning(changed(numbers)):
            Ledger(kept, SILENT).one("generate", lambda placer, progress: noun(1), placer)
        return kept.computed

    numbers: Changes = {"align.judge": {"slab_m": 0.02}}
    for work, placer, again in (("placed", Placer(), ["generate/scene"]), ("unplaced", None, [])):
        assert computed(work, placer, {}) == ["generate/scene"]
        assert computed(work, placer, numbers) == again


def test_a_damaged_stored_result_is_recomputed(tmp_path: Path) -> None:
    work = run(tmp_path, {"a": 1})
    path = work.noun_path("segment", "a")
    path.write_bytes(path.read_bytes()[:-20])
    assert run(tmp_path, {"a": 1}).computed == ["segment/a"]


def test_one_failing_object_does_not_stop_the_others(tmp_path: Path) -> None:
    def compute(name: str, progress: Progress) -> PackedMask:
        if name == "a":
            raise ObjectNotSeen("a: no frame shows it")
        return noun(1)

    ledger = Ledger(Workspace(tmp_path), SILENT)
    assert list(ledger.each("segment", compute, "ab", {name: name for name in "ab"})) == ["b"]
    assert ledger.failures == {"a": "segment: a: no frame shows it"}


@pytest.mark.parametrize("error", [np.linalg.LinAlgError("SVD did not converge"), ValueError("bad"), cv2.error("(-215) empty")])
def test_a_numerical_error_in_one_object_is_logged_and_others_continue(
    error: Exception, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    def compute(name: str, progress: Progress) -> PackedMask:
        if name == "a":
            raise error
        return noun(1)

    ledger = Ledger(Workspace(tmp_path), SILENT)
    assert list(ledger.each("align", compute, "ab", {name: name for name in "ab"})) == ["b"]
    assert ledger.failures["a"].startswith(f"align: a: {'error' if isinstance(error, cv2.error) else type(error).__name__}: ")
    assert "\n" not in ledger.failures["a"]
    assert caplog.records[0].exc_info is not None


@pytest.mark.parametrize("error", [Cancelled("stopped"), BackendUnavailable("gone"), TypeError("a bug"), MemoryError()])
def test_an_error_that_affects_all_objects_ends_the_run(error: Exception, tmp_path: Path) -> None:
    def compute(progress: Progress) -> PackedMask:
        raise error

    with pytest.raises(type(error)):
        Ledger(Workspace(tmp_path), SILENT).each("align", compute, "a")


def test_stages_after_the_requested_one_are_not_started(tmp_path: Path) -> None:
    ledger = Ledger(Workspace(tmp_path), SILENT, until="segment")
    with pytest.raises(Reached):
        ledger.one("generate", lambda progress: noun(1))


def test_a_second_run_in_a_locked_workspace_is_rejected(tmp_path: Path) -> None:
    first, second = Workspace(tmp_path), Workspace(tmp_path)
    with first.locked(), pytest.raises(EnvironmentProblem, match="another run"), second.locked():
        pass


def masked(name: str, progress: Progress) -> PackedMask:
    if name == "d":
        raise ObjectNotSeen("d: no frame shows it")
    return noun(1)


def grown(mask: PackedMask, progress: Progress) -> PackedMask:
    return noun(mask.area_px + 1)


def of_some(root: Path, only: list[str] | None, until: Stage = "generate") -> Ledger:
    """A run of some objects, or of all, through two stages; d fails in the first."""
    ledger = Ledger(Workspace(root), SILENT, until=until, only=only)
    with suppress(Reached):
        masks = ledger.each("segment", masked, "abcd", {name: name for name in "abcd"})
        ledger.each("generate", grown, masks, masks)
    return ledger


def test_a_partial_run_computes_only_its_objects_in_its_stage(tmp_path: Path) -> None:
    assert of_some(tmp_path, ["b"]).work.computed == []
    of_some(tmp_path, None, "segment")
    assert of_some(tmp_path, ["b"]).work.computed == ["generate/b"]
    assert of_some(tmp_path, ["a", "d"]).work.computed == ["generate/a"]
    joined = of_some(tmp_path, None)
    assert (joined.work.computed, joined.failures) == (["generate/c"], {"d": "segment: d: no frame shows it"})


def test_a_run_without_objects_lists_the_remaining_ones(tmp_path: Path) -> None:
    assert of_some(tmp_path, [], "segment").left == ["a", "b", "c", "d"]
    of_some(tmp_path, None, "segment")
    assert of_some(tmp_path, []).left == ["a", "b", "c"]
    of_some(tmp_path, ["b"])
    none = of_some(tmp_path, [])
    assert (none.left, none.work.computed, none.failures) == (["a", "c"], [], {})


HOLDS = """
import pathlib, sys
from r2c2r_core.errors import EnvironmentProblem
from r2c2r_core.workspace import Workspace
for parts in sys.argv[2:]:
    try:
        with Workspace(pathlib.Path(sys.argv[1])).locked(parts.split()):
            print("held")
    except EnvironmentProblem as refused:
        print(refused)
"""


def at_once(root: Path, *wanted: str) -> list[bool]:
    """Whether another process may take parts, or the whole (""), and release them; one after the other."""
    command = [sys.executable, "-c", HOLDS, str(root), *wanted]
    told = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    assert len(told) == len(wanted)
    assert all(line == "held" or "another run is using this folder" in line for line in told)
    return [line == "held" for line in told]


def test_workspace_parts_can_be_locked_in_parallel_but_not_twice(tmp_path: Path) -> None:
    with Workspace(tmp_path).locked(["align/a", "align/b"]):
        assert at_once(tmp_path, "align/c generate/a", "align/c align/b", "") == [True, False, False]
    with Workspace(tmp_path).locked():
        assert at_once(tmp_path, "align/a") == [False]
    assert at_once(tmp_path, "", "align/a") == [True, True]


def test_a_full_disk_raises_and_keeps_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "noun"
    write_atomically(path, b"old")

    def full(self: Path, content: bytes) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(EnvironmentProblem, match="disk is full"):
        write_atomically(path, b"new")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_other_io_errors_report_the_path(tmp_path: Path) -> None:
    with pytest.raises(EnvironmentProblem, match="nowhere"), explained_io(tmp_path / "nowhere"):
        (tmp_path / "nowhere" / "x").write_text("")


def test_file_keys_depend_on_content(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("1")
    before = file_key(tmp_path / "a"), file_key(tmp_path)
    assert (file_key(tmp_path / "a"), file_key(tmp_path)) == before
    (tmp_path / "a").write_text("22")
    assert file_key(tmp_path / "a") != before[0]
    assert file_key(tmp_path) != before[1]


def test_concurrent_atomic_writes_do_not_mix_contents(tmp_path: Path) -> None:
    path = tmp_path / "overrides.json"
    with ThreadPoolExecutor(8) as pool:
        for done in [pool.submit(write_atomically, path, bytes([value]) * 100_000) for value in range(160)]:
            done.result()
    content = path.read_bytes()
    assert len(content) == 100_000
    assert len(set(content)) == 1
    assert [entry.name for entry in tmp_path.iterdir()] == ["overrides.json"]
