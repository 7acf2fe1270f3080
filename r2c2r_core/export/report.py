"""report.json and report.html: the certificate and the accuracy of a bundle, for programs and for people."""

import html
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from r2c2r_core.export.alone import ALLOWED_DRIFT_M
from r2c2r_core.export.certify import certificate_to_json
from r2c2r_core.export.contacts import ALLOWED_PENETRATION_M
from r2c2r_core.export.rules.table import EVERY_RULE
from r2c2r_core.export.seen import unseen_words
from r2c2r_core.export.sweeps import NEEDED_CAVITY, NEEDED_TRAVEL
from r2c2r_core.export.writers.table import formats
from r2c2r_core.model.report import Certificate
from r2c2r_core.robot.arms import MAP
from r2c2r_core.texts import shown

REPORT_VERSION = 1

_ASSETS = Path(__file__).parent / "report_page"


def report_of(
    manifest: dict[str, Any],
    certificate: Certificate,
    failures: dict[str, str],
    gripper: dict[str, Any] | None = None,
    arm: dict[str, Any] | None = None,
) -> dict[str, Any]:
    """The report as a JSON document, without the simulation speed, which depends on this machine.

    `gripper` and `arm` are their certificates as JSON, or `why` they tried nothing; None where they were not to try.
    """
    judged = certificate_to_json(certificate)
    judged.pop("realtime_factor")
    for loader in judged["loaders"]:
        loader.pop("steps_per_s")
    return {
        "version": REPORT_VERSION,
        "tool_version": manifest["tool_version"],
        "certificate": judged,
        "gripper": gripper,
        "arm": arm,
        "objects": [_object_row(entry) for entry in manifest["objects"]],
        "failures": dict(sorted(failures.items())),
        "losses": {entry.file: list(entry.loses) for entry in formats()},
    }


def report_html(manifest: dict[str, Any], report: dict[str, Any], pictures: dict[str, str]) -> str:
    """One self-contained page (pictures are files beside it); `pictures` maps object names to files in the bundle.

    All text from data is escaped, and the page has no script.
    """
    certificate = report["certificate"]
    name = _text(manifest["capture"]["name"])
    body = "\n".join(
        part
        for part in (
            _headline(manifest, certificate),
            '<figure class="wide"><img src="preview.png" alt="The scene with every joint closed, and opened"></figure>',
            _findings(certificate["findings"]),
            _failures(report["failures"]),
            _objects(manifest["objects"], pictures),
            _joints(manifest["objects"], certificate["joints"]),
            _things(certificate["things"]),
            _colliders(certificate["colliders"]),
            _robot("A gripper", report["gripper"], _gripper),
            _robot("An arm", report["arm"], _arm),
            _loaders(certificate["loaders"]),
            _stages(manifest["stages"]),
            _losses(report["losses"]),
        )
        if part
    )
    page = (_ASSETS / "page.html").read_text(encoding="utf-8")
    marks = {
        "<!--TITLE-->": f"{name}: report",
        "/*STYLE*/": (_ASSETS / "page.css").read_text(encoding="utf-8"),
        "<!--BODY-->": body,
    }
    for mark, content in marks.items():
        page = page.replace(mark, content)
    return page


def _likeness(likeness: dict[str, Any]) -> str:
    """The likeness verdict, with the objects to check."""
    badge = {"passed": "good", "doubtful": "warn", "failed": "bad"}[likeness["state"]]
    names = ", ".join(_text(doubt["object"]) for doubt in likeness["doubts"])
    look_at = f": look at {names}" if names else ""
    return f'<p>Likeness <span class="badge {badge}">{likeness["state"]}</span>{look_at}</p>'


def _object_row(entry: dict[str, Any]) -> dict[str, Any]:
    placement, mask = entry["placement"] or {}, entry["mask"] or {}
    return {
        "name": entry["name"],
        "category": entry["category"],
        "dimensions_m": entry["dimensions_m"],
        "dimension_source": entry["dimension_source"],
        "joints": [{"name": j["name"], "type": j["type"], "upper": j["upper"], "source": j["source"]} for j in entry["joints"]],
        "mask_frames": mask.get("frames", 0),
        "placement_rms_m": placement.get("rms_m"),
        "placement_inliers": placement.get("inliers"),
        "warp_residual_m": entry["warp"]["residual_m"],
        "scan_fit": entry["scan_fit"],
        "seen": entry["seen"],
        "mass_kg": entry["mass_kg"],
        "warnings": entry["warnings"],
    }


def _headline(manifest: dict[str, Any], certificate: dict[str, Any]) -> str:
    passed = certificate["passed"]
    verdict = '<span class="badge good">passed</span>' if passed else '<span class="badge bad">failed</span>'
    travels = [j["travel_reached"] for j in certificate["joints"] if j["travel_reached"] is not None]
    sweeps = [j["deepest_penetration_m"] for j in certificate["joints"] if j["deepest_penetration_m"] is not None]
    cavities = [j["cavity_open"] for j in certificate["joints"] if j["cavity_open"] is not None]
    tried = [r for r in certificate["loaders"] if r["state"] != "not tried"]
    rest, drift = certificate["rest_penetration_m"], certificate["drift_m"]
    tiles = [
        ("objects", str(len(manifest["objects"])), ""),
        ("joints", str(len(certificate["joints"])), ""),
        ("least travel", _percent(min(travels, default=None)), f"needs {100 * NEEDED_TRAVEL:.0f} %"),
        ("deepest in any sweep", _millimetres(max(sweeps, default=None)), f"at most {1000 * ALLOWED_PENETRATION_M:.1f} mm"),
        ("deepest at rest", _millimetres(rest), f"at most {1000 * ALLOWED_PENETRATION_M:.1f} mm"),
        ("drift in 5 s", _millimetres(drift), f"at most {1000 * ALLOWED_DRIFT_M:.0f} mm"),
        ("least inside free", _percent(min(cavities, default=None)), f"needs {100 * NEEDED_CAVITY:.0f} %"),
        ("loaders passed", f"{sum(r['state'] == 'passed' for r in tried)} of {len(tried)} tried", ""),
    ]
    cells = "".join(f"<div><dt>{label}</dt><dd>{value}</dd><small>{note}</small></div>" for label, value, note in tiles)
    capture = manifest["capture"]
    source = f"{_text(capture['format'])}, {_text(capture['frames'])} frames, sha256 {_text(capture['sha256'])[:12]}…"
    created = f" · {_text(manifest['created'])}" if manifest.get("created") else ""
    return (
        f"<header><h1>{_text(capture['name'])}</h1><p>Certificate {verdict}</p>{_likeness(certificate['likeness'])}"
        f'<p class="quiet">{source} · r2c2r {_text(manifest["tool_version"])}{created}</p>'
        '<p><a href="review.html">Open the scene and its doors</a> · <a href="README.txt">How to load it</a></p></header>'
        f'<dl class="tiles">{cells}</dl>'
    )


def _findings(findings: list[dict[str, Any]]) -> str:
    if not findings:
        return "<h2>Findings</h2><p>The linter and the simulation found nothing to complain about.</p>"
    by_rule: dict[str, list[dict[str, Any]]] = {}
    for found in findings:
        by_rule.setdefault(found["rule"], []).append(found)
    rows = [
        [
            _severity(hits[0]["severity"]),
            f'<strong>{_text(rule)}</strong><br><span class="quiet">{_text(EVERY_RULE[rule].protects)}</span>',
            "<ul>" + "".join(f"<li>{_name(hit['where'])} {_text(hit['message'])}</li>" for hit in hits) + "</ul>",
        ]
        for rule, hits in by_rule.items()
    ]
    return "<h2>Findings</h2>" + _table(["", "rule, and what it protects from", "where and what"], rows)


def _failures(failures: dict[str, str]) -> str:
    if not failures:
        return ""
    rows = [[f"<code>{_text(name)}</code>", _text(reason)] for name, reason in failures.items()]
    return "<h2>Objects that are not in the bundle</h2>" + _table(["object", "why"], rows)


def _objects(objects: list[dict[str, Any]], pictures: dict[str, str]) -> str:
    rows, below = [], []
    for entry in objects:
        picture = pictures.get(entry["name"])
        image = f'<img class="thumb" src="{_text(picture)}" alt="{_text(entry["name"])}">' if picture else ""
        placement, fit = entry["placement"] or {}, entry["scan_fit"] or {}
        sizes = " × ".join(
            f"{1000 * size:.0f}<sup>{_SHORT.get(source, '')}</sup>"
            for size, source in zip(entry["dimensions_m"], entry["dimension_source"], strict=True)
        )
        notes = "".join(f"<li>{_text(line)}</li>" for line in entry["warnings"])
        below.append(f'<ul class="quiet">{notes}</ul>' if notes else "")
        rows.append(
            [
                image,
                f'<strong>{_text(entry["name"])}</strong><br><span class="quiet">{_text(entry["category"])}</span>',
                f'<span class="sizes">{sizes}</span>',
                f"{entry['mass_kg']:.1f}",
                _text((entry["mask"] or {}).get("frames", "–")),
                _millimetres(placement.get("rms_m")),
                _millimetres(entry["warp"]["residual_m"]),
                _millimetres(fit.get("median_m")),
                _percent(fit.get("f_score_1cm")),
                _seen(entry),
            ]
        )
    head = [
        "",
        "object",
        "width × depth × height, mm",
        "kg",
        "frames",
        "placed within",
        "front fits within",
        "scan to mesh",
        "F at 1 cm",
        "seen",
    ]
    legend = '<p class="quiet">m measured · ≥ as far as it was seen to open · i inferred · d default of the category · '
    legend += "p given by a person. "
    legend += (
        "Scan to mesh: median distance of the depth points to the closed model; F: points and visible surface within 1 cm. "
        "Seen: share of the surface that a frame shows, but for the underside; the rest is a guess. "
    )
    pair = "Pictures: the photo, and the closed model from the same camera.</p>" if pictures else "</p>"
    return "<h2>Objects</h2>" + _table(head, rows, numeric=(3, 4, 5, 6, 7, 8), below=below) + legend + pair


def _seen(entry: dict[str, Any]) -> str:
    if entry["seen"] is None:
        return "–"
    return f'{_percent(entry["seen"]["share"])}<br><span class="quiet">{_text(unseen_words(entry["seen"]["unseen"]))}</span>'


def _joints(objects: list[dict[str, Any]], results: list[dict[str, Any]]) -> str:
    by_name = {r["joint"]: r for r in results}
    rows = []
    for entry in objects:
        for joint in entry["joints"]:
            result = by_name.get(joint["name"], {})
            turning = joint["type"] == "revolute"
            reach = f"{joint['upper'] * 57.29578:.0f}°" if turning else f"{1000 * joint['upper']:.0f} mm"
            source = ", ".join(f"{key} {_text(value)}" for key, value in joint["source"].items() if value)
            travel, deepest = result.get("travel_reached"), result.get("deepest_penetration_m")
            rows.append(
                [
                    _name(joint["name"]),
                    "hinge" if turning else "slide",
                    reach,
                    _judged(_percent(travel), travel is not None and travel >= NEEDED_TRAVEL),
                    _judged(_millimetres(deepest), deepest is not None and deepest <= ALLOWED_PENETRATION_M),
                    _percent(result.get("cavity_open")),
                    _in_the_way(result.get("blocked_by", []), turning),
                    f'<span class="quiet">{source}</span>',
                ]
            )
    head = [
        "joint",
        "kind",
        "opens",
        "travel reached",
        "deepest in sweep",
        "inside free",
        "in its way",
        "where its numbers come from",
    ]
    return "<h2>Joints</h2>" + _table(head, rows, numeric=(2, 3, 4, 5)) if rows else ""


def _in_the_way(blockers: list[dict[str, Any]], turning: bool) -> str:
    """Obstacles of a joint and the position of first contact; another joint's part collides only when open too."""
    lines = []
    for blocker in blockers:
        at = f"{blocker['position'] * 57.29578:.0f}°" if turning else f"{1000 * blocker['position']:.0f} mm"
        when = " when open" if blocker["kind"] == "joint" else ""
        lines.append(f"<li>{_name(blocker['name'])}{when}, from {at}</li>")
    return f"<ul>{''.join(lines)}</ul>" if lines else "–"


def _things(things: list[dict[str, Any]]) -> str:
    if not things:
        return ""
    rows = [
        [
            _name(thing["name"]),
            _judged(_millimetres(thing["drift_m"]), thing["drift_m"] is not None and thing["drift_m"] <= ALLOWED_DRIFT_M),
            _percent(thing["opening_free"]),
        ]
        for thing in things
    ]
    head = ["free-standing", "moved in 5 s, untouched", "cavity free of colliders"]
    return "<h2>Free-standing things</h2>" + _table(head, rows, numeric=(1, 2))


def _colliders(colliders: list[dict[str, Any]]) -> str:
    """Table of the distances between colliders and visuals."""
    if not colliders:
        return ""
    ways = ("drawn_to_collider", "collider_to_drawn")
    worst = sorted(colliders, key=lambda fit: -max(fit[way]["p95_m"] for way in ways))
    rows = [
        [_name(fit["link"]), *(_millimetres(fit[way][key]) for way in ways for key in ("median_m", "p95_m", "most_m"))]
        for fit in worst
    ]
    head = ["link", "drawn to collider", "95 %", "most", "collider to drawn", "95 %", "most"]
    said = "Distances in millimetres from points of one surface to the other: the median, what 95 % keep below, and the most."
    return f'<h2>Colliders beside what is drawn</h2><p class="quiet">{said}</p>' + _table(
        head, rows, numeric=tuple(range(1, 7))
    )


def _robot(title: str, trials: dict[str, Any] | None, results: Callable[[dict[str, Any]], str]) -> str:
    """Section of a robot: its results, or why it tried nothing."""
    if trials is None or trials.get("grips") == []:
        return ""
    return f"<h2>{title}</h2>" + (f"<p>Not tried: {_text(trials['why'])}</p>" if "why" in trials else results(trials))


def _gripper(gripper: dict[str, Any]) -> str:
    """Gripper results, with a contact sheet of each trial."""
    about = gripper["gripper"]
    said = (
        f"A floating parallel gripper ({1000 * about['stroke_m']:.0f} mm stroke, {about['grips_n'][0]:.0f} N, "
        f"or {about['grips_n'][1]:.0f} N where that slips) held by nothing but the friction of its pads opened and closed "
        f"{gripper['joints_opened']} of {gripper['joints']} joints and moved {gripper['things_moved']} of {gripper['things']} "
        f"free things by 10 cm. push: no handle; pressed, then taken as thrown out {1000 * about['latch_throw_m']:.0f} mm by a "
        "push latch, which is no part of the bundle, and pulled by its edge."
    )
    return f'<p class="quiet">{said}</p>' + _grips("gripper", gripper["grips"])


def _arm(arm: dict[str, Any]) -> str:
    """Arm base positions on the floor plan, and results from there."""
    about = arm["arm"]
    said = (
        f"A {_text(about['name'])} ({_text(about['source'])}) on a lifting column reaches {arm['joints_in_reach']} of "
        f"{arm['joints']} joints without collision, from {len(arm['places'])} places. It opened and closed "
        f"{arm['joints_opened']} of them by the friction of its pads."
    )
    picture = (
        f'<img src="arm/{MAP}" alt="The floor plan with the places where the arm stands, numbered; they are listed in it">'
    )
    return f'<p class="quiet">{said}</p><figure>{picture}</figure>' + _grips("arm", arm["grips"])


def _grips(folder: str, grips: list[dict[str, Any]]) -> str:
    rows = [
        [
            _sheet(folder, grip["film"]),
            _name(grip["name"]),
            _judged("yes" if grip["passed"] else "no", grip["passed"]),
            _text(grip["method"] or "–"),
            "–" if grip["grip_n"] is None else f"{grip['grip_n']:.0f} N",
            _percent(grip["opened"]),
            _millimetres(grip["slip_m"] if grip["kind"] == "joint" else grip["off_m"]),
            "–" if grip["force_n"] is None else f"{grip['force_n']:.0f} N",
            _text(f"{grip['why']} (the {grip['blame']})" if grip["blame"] else grip["why"] or "–"),
        ]
        for grip in grips
    ]
    head = ["", "where", "done", "how", "grip", "opened", "slip, or offset from the goal", "most force", "reason and cause"]
    return _table(head, rows, numeric=(4, 5, 6, 7))


def _sheet(folder: str, name: str | None) -> str:
    if name is None:
        return ""
    file = _text(f"{folder}/{name}")
    return f'<a href="{file}.jpg"><img class="sheet" src="{file}.jpg" alt="The {folder} at {_text(name)}"></a>'


def _loaders(loaders: list[dict[str, Any]]) -> str:
    badges = {"passed": "good", "failed": "bad", "not tried": "none"}
    rows = [
        [_text(r["loader"]), f'<span class="badge {badges[r["state"]]}">{_text(r["state"])}</span>', _text(r["detail"])]
        for r in loaders
    ]
    return "<h2>Loaders</h2>" + _table(["loader", "", "read back"], rows)


def _stages(stages: list[dict[str, Any]]) -> str:
    rows = [[_text(s["name"]), _text(s["backend"] or "–")] for s in stages]
    return "<h2>How it was made</h2>" + _table(["stage", "backend"], rows) if rows else ""


def _losses(losses: dict[str, list[str]]) -> str:
    items = "".join(f"<dt><code>{_text(file)}</code></dt><dd>{_text('; '.join(lines))}</dd>" for file, lines in losses.items())
    return f'<h2>What each file leaves out</h2><dl class="losses">{items}</dl>'


def _table(head: list[str], rows: list[list[str]], numeric: tuple[int, ...] = (), below: Sequence[str] = ()) -> str:
    """An HTML table; `below` gives for each row the content under all but its first cell, or nothing."""

    def cells(tag: str, values: list[str]) -> str:
        marks = [' class="number"' if k in numeric else "" for k in range(len(values))]
        return "".join(f"<{tag}{mark}>{value}</{tag}>" for mark, value in zip(marks, values, strict=True))

    def line(row: list[str], note: str) -> str:
        if not note:
            return f"<tr>{cells('td', row)}</tr>"
        rest = cells("td", ["", *row[1:]]).removeprefix("<td></td>")
        under = f'<tr><td colspan="{len(row) - 1}">{note}</td></tr>'
        return f'<tr class="noted"><td rowspan="2">{row[0]}</td>{rest}</tr>{under}'

    lines = "".join(line(row, note) for row, note in zip(rows, below or [""] * len(rows), strict=True))
    return f'<div class="scroll"><table><thead><tr>{cells("th", head)}</tr></thead><tbody>{lines}</tbody></table></div>'


def _name(name: str) -> str:
    """A name of the bundle, which may wrap after its underscores."""
    return f"<code>{_text(name).replace('_', '_<wbr>')}</code>"


def _severity(severity: str) -> str:
    return f'<span class="badge {"bad" if severity == "error" else "warn"}">{_text(severity)}</span>'


def _judged(value: str, good: bool) -> str:
    return f'<span class="{"" if good else "wrong"}">{value}</span>'


def _percent(value: float | None) -> str:
    return "–" if value is None else f"{100 * value:.0f} %"


def _millimetres(value: float | None) -> str:
    return "–" if value is None else f"{1000 * value:.1f} mm"


def _text(value: object) -> str:
    return html.escape(shown(str(value)), quote=True)


_SHORT = {"measured": "m", "at_least": "≥", "inferred": "i", "default": "d", "person": "p"}
