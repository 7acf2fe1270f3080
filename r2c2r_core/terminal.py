"""Command-line output: progress on stderr, tables, certificates."""

import contextlib
import math
import sys
import time
from collections.abc import Iterator, Sequence

from r2c2r_core.model.report import Certificate, LoaderResult
from r2c2r_core.progress import Progress
from r2c2r_core.robot.arm_certificate import ArmCertificate
from r2c2r_core.robot.certificate import Grip, GripperCertificate
from r2c2r_core.robot.panda import NAME
from r2c2r_core.texts import shown


@contextlib.contextmanager
def show_progress() -> Iterator[Progress]:
    """Progress display: a live line on a terminal, one line per step when piped."""
    reporter = _Live() if sys.stderr.isatty() else _Lines()
    try:
        yield Progress(reporter.report)
    finally:
        reporter.close()


def table(titles: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Aligned plain-text columns, with control characters escaped."""
    cells = [[" ".join(shown(cell).split("\n")) for cell in row] for row in [titles, *rows]]
    widths = [max(len(row[k]) for row in cells) for k in range(len(titles))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in cells]
    return "\n".join([lines[0], "  ".join("-" * width for width in widths), *lines[1:]])


def certificate_text(certificate: Certificate) -> str:
    """The certificate as text for a terminal."""
    joints = [(j.joint, f"{1000 * j.deepest_penetration_m:.2f}", f"{100 * j.travel_reached:.0f}") for j in certificate.joints]
    lines = [
        table(("joint", "deepest mm", "travel %"), joints) if joints else "no joints",
        "",
        *(f"{loader.loader}: {loader.state} {loader.detail}{_speed(loader)}".rstrip() for loader in certificate.loaders),
        *(f"{finding.severity}: {finding.rule}: {finding.where}: {finding.message}" for finding in certificate.findings),
        f"deepest contact at rest {1000 * certificate.rest_penetration_m:.2f} mm, drift {1000 * certificate.drift_m:.2f} mm, "
        f"{certificate.realtime_factor:.0f} x real time",
        verdict(certificate),
    ]
    return shown("\n".join(lines))


def verdict(certificate: Certificate) -> str:
    """Both verdicts in a line: simulation, and likeness to the recording."""
    likeness = certificate.likeness
    look_at = f" (look at {', '.join(name for name, _ in likeness.doubts)})" if likeness.doubts else ""
    state = "FAILED" if likeness.state == "failed" else likeness.state
    return f"certificate {'passed' if certificate.passed else 'FAILED'}, likeness {state}{look_at}"


def _speed(loader: LoaderResult) -> str:
    """Step rates measured here, for one world and for many in parallel."""
    return "".join(f"; {speed:.0f} steps/s in {worlds} world{'s' * (worlds > 1)}" for worlds, speed in loader.steps_per_s)


def gripper_text(certificate: GripperCertificate) -> str:
    """The gripper's certificate as text for a terminal."""
    (opened, joints), (moved, things) = certificate.share("joint"), certificate.share("thing")
    said = f"the gripper opens and closes {opened} of {joints} joints and moves {moved} of {things} free things"
    return shown("\n".join([*_grips("gripper at", certificate.grips), said]))


def arm_text(certificate: ArmCertificate) -> str:
    """The arm's certificate as text for a terminal."""
    places = [
        f"stand {number} at x {stand.x_m:.1f}, y {stand.y_m:.1f} m, lifted {stand.lift_m:.1f} m, for {', '.join(joints)}"
        for number, (stand, joints) in enumerate(certificate.places.items(), 1)
    ]
    said = f"a {NAME} opens and closes {certificate.opened} of {len(certificate.grips)} joints from {len(places)} places"
    return shown("\n".join([*_grips("arm at", certificate.grips), *places, said]))


def _grips(title: str, grips: Sequence[Grip]) -> list[str]:
    rows = [
        (
            grip.name,
            grip.method or "-",
            "yes" if grip.passed else "NO",
            _figure(grip.grip_n),
            _figure(100 * grip.opened),
            _figure(1000 * grip.slip_m),
            _figure(grip.force_n),
        )
        for grip in grips
    ]
    return [
        table((title, "how", "done", "grip N", "open %", "slip mm", "force N"), rows) if rows else "nothing to grasp",
        "",
        *(f"{grip.name}: {grip.why}{f' (the {grip.blame})' * (grip.blame is not None)}" for grip in grips if grip.why),
    ]


def _figure(value: float) -> str:
    return f"{value:.0f}" if math.isfinite(value) else "-"


class _Live:
    def __init__(self) -> None:
        self.started = time.monotonic()
        self.stage = ""

    def report(self, stage: str, fraction: float, text: str) -> None:
        if self.stage and stage != self.stage:
            sys.stderr.write("\n")
        self.stage = stage
        filled = int(24 * fraction)
        bar = "#" * filled + "." * (24 - filled)
        elapsed = time.monotonic() - self.started
        sys.stderr.write(f"\r\033[K{stage:<11}[{bar}] {100 * fraction:3.0f} %  {elapsed:5.0f} s  {shown(text[:60])}")
        sys.stderr.flush()

    def close(self) -> None:
        if self.stage:
            sys.stderr.write("\n")


class _Lines:
    def __init__(self) -> None:
        self.last = ("", "")

    def report(self, stage: str, fraction: float, text: str) -> None:
        step = (stage, text.rstrip("0123456789/ "))  # a changed count is not a new step
        if step != self.last:
            self.last = step
            sys.stderr.write(f"{stage} {100 * fraction:.0f} % {shown(text)}".rstrip() + "\n")
            sys.stderr.flush()

    def close(self) -> None:
        pass
