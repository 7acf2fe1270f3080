"""report.json and report.html: the certificate and the accuracy of a bundle, for programs and for people."""

import html
from typing import Any

from r2c2r_core.export.alone import ALLOWED_DRIFT_M
from r2c2r_core.export.certify import certificate_to_json
from r2c2r_core.export.contacts import ALLOWED_PENETRATION_M
from r2c2r_core.export.rules.table import RULES, SIMULATION_RULES
from r2c2r_core.export.sweeps import NEEDED_TRAVEL
from r2c2r_core.export.writers.table import FORMATS
from r2c2r_core.model.report import Certificate

REPORT_VERSION = 1


def report_of(manifest: dict[str, Any], certificate: Certificate, failures: dict[str, str]) -> dict[str, Any]:
    """The report as a JSON document. The speed of the simulation is left out: it says something about this machine."""
    judged = certificate_to_json(certificate)
    judged.pop("realtime_factor")
    return {
        "version": REPORT_VERSION,
        "tool_version": manifest["tool_version"],
        "certificate": judged,
        "objects": [_object_row(entry) for entry in manifest["objects"]],
        "failures": dict(sorted(failures.items())),
        "losses": {entry.file: list(entry.loses) for entry in FORMATS},
    }


def report_html(manifest: dict[str, Any], report: dict[str, Any], pictures: dict[str, str]) -> str:
    """One self-contained page (pictures are files beside it); `pictures` maps object names to files in the bundle.

    Everything that comes from data is escaped, and the page holds no script.
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
            _loaders(certificate["loaders"]),
            _stages(manifest["stages"]),
            _losses(report["losses"]),
        )
        if part
    )
    return _PAGE.format(title=f"{name}: report", style=_STYLE, body=body)


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
        "mass_kg": entry["mass_kg"],
        "warnings": entry["warnings"],
    }


def _headline(manifest: dict[str, Any], certificate: dict[str, Any]) -> str:
    passed = certificate["passed"]
    verdict = '<span class="badge good">passed</span>' if passed else '<span class="badge bad">failed</span>'
    travels = [j["travel_reached"] for j in certificate["joints"] if j["travel_reached"] is not None]
    sweeps = [j["deepest_penetration_m"] for j in certificate["joints"] if j["deepest_penetration_m"] is not None]
    tried = [r for r in certificate["loaders"] if r["state"] != "not tried"]
    rest, drift = certificate["rest_penetration_m"], certificate["drift_m"]
    tiles = [
        ("objects", str(len(manifest["objects"])), ""),
        ("joints", str(len(certificate["joints"])), ""),
        ("least travel", _percent(min(travels, default=None)), f"needs {100 * NEEDED_TRAVEL:.0f} %"),
        ("deepest in any sweep", _millimetres(max(sweeps, default=None)), f"at most {1000 * ALLOWED_PENETRATION_M:.1f} mm"),
        ("deepest at rest", _millimetres(rest), f"at most {1000 * ALLOWED_PENETRATION_M:.1f} mm"),
        ("drift in 5 s", _millimetres(drift), f"at most {1000 * ALLOWED_DRIFT_M:.0f} mm"),
        ("loaders passed", f"{sum(r['state'] == 'passed' for r in tried)} of {len(tried)} tried", ""),
    ]
    cells = "".join(f"<div><dt>{label}</dt><dd>{value}</dd><small>{note}</small></div>" for label, value, note in tiles)
    capture = manifest["capture"]
    source = f"{_text(capture['format'])}, {_text(capture['frames'])} frames, sha256 {_text(capture['sha256'])[:12]}…"
    created = f" · {_text(manifest['created'])}" if manifest.get("created") else ""
    return (
        f"<header><h1>{_text(capture['name'])}</h1><p>Certificate {verdict}</p>"
        f'<p class="quiet">{source} · r2c2r {_text(manifest["tool_version"])}{created}</p></header>'
        f'<dl class="tiles">{cells}</dl>'
    )


def _findings(findings: list[dict[str, Any]]) -> str:
    if not findings:
        return "<h2>Findings</h2><p>The linter and the simulation found nothing to complain about.</p>"
    protects = RULES | SIMULATION_RULES
    rows = [
        [
            _severity(f["severity"]),
            f"<code>{_text(f['where'])}</code>",
            _text(f["message"]),
            f'<span class="quiet">{_text(f["rule"])}: {_text(protects[f["rule"]].protects)}</span>',
        ]
        for f in findings
    ]
    return "<h2>Findings</h2>" + _table(["", "where", "what", "rule, and what it protects from"], rows)


def _failures(failures: dict[str, str]) -> str:
    if not failures:
        return ""
    rows = [[f"<code>{_text(name)}</code>", _text(reason)] for name, reason in failures.items()]
    return "<h2>Objects that are not in the bundle</h2>" + _table(["object", "why"], rows)


def _objects(objects: list[dict[str, Any]], pictures: dict[str, str]) -> str:
    rows = []
    for entry in objects:
        picture = pictures.get(entry["name"])
        image = f'<img class="thumb" src="{_text(picture)}" alt="{_text(entry["name"])}">' if picture else ""
        placement = entry["placement"] or {}
        sizes = " × ".join(
            f"{1000 * size:.0f}<sup>{_SHORT.get(source, '')}</sup>"
            for size, source in zip(entry["dimensions_m"], entry["dimension_source"], strict=True)
        )
        notes = "".join(f"<li>{_text(line)}</li>" for line in entry["warnings"])
        rows.append(
            [
                image,
                f'<strong>{_text(entry["name"])}</strong><br><span class="quiet">{_text(entry["category"])}</span>',
                f'<span class="sizes">{sizes}</span>',
                f"{entry['mass_kg']:.1f}",
                _text((entry["mask"] or {}).get("frames", "–")),
                _millimetres(placement.get("rms_m")),
                _millimetres(entry["warp"]["residual_m"]),
                f"<ul>{notes}</ul>" if notes else "",
            ]
        )
    head = ["", "object", "width × depth × height, mm", "kg", "frames", "placed within", "front fits within", "notes"]
    legend = '<p class="quiet">m measured · i inferred · d default of the category · p given by a person. '
    pair = "Pictures: the photo, and the closed model from the same camera.</p>" if pictures else "</p>"
    return "<h2>Objects</h2>" + _table(head, rows, numeric=(3, 4, 5, 6)) + legend + pair


def _joints(objects: list[dict[str, Any]], results: list[dict[str, Any]]) -> str:
    by_name = {r["joint"]: r for r in results}
    rows = []
    for entry in objects:
        for joint in entry["joints"]:
            result = by_name.get(joint["name"], {})
            turning = joint["type"] == "revolute"
            reach = f"{joint['upper'] * 57.29578:.0f}°" if turning else f"{1000 * joint['upper']:.0f} mm"
            source = ", ".join(f"{key} {_text(value)}" for key, value in joint["source"].items())
            travel, deepest = result.get("travel_reached"), result.get("deepest_penetration_m")
            rows.append(
                [
                    f"<code>{_text(joint['name'])}</code>",
                    "hinge" if turning else "slide",
                    reach,
                    _judged(_percent(travel), travel is not None and travel >= NEEDED_TRAVEL),
                    _judged(_millimetres(deepest), deepest is not None and deepest <= ALLOWED_PENETRATION_M),
                    _percent(result.get("cavity_open")),
                    f'<span class="quiet">{source}</span>',
                ]
            )
    head = ["joint", "kind", "opens", "travel reached", "deepest in sweep", "inside free", "where its numbers come from"]
    return "<h2>Joints</h2>" + _table(head, rows, numeric=(2, 3, 4, 5)) if rows else ""


def _loaders(loaders: list[dict[str, Any]]) -> str:
    badges = {"passed": "good", "failed": "bad", "not tried": "none"}
    rows = [
        [_text(r["loader"]), f'<span class="badge {badges[r["state"]]}">{_text(r["state"])}</span>', _text(r["detail"])]
        for r in loaders
    ]
    return "<h2>Loaders</h2>" + _table(["loader", "", "read back"], rows)


def _stages(stages: list[dict[str, Any]]) -> str:
    rows = [[_text(s["name"]), _text(s["backend"] or "–"), f"{s['seconds']:.1f} s"] for s in stages]
    return "<h2>How it was made</h2>" + _table(["stage", "backend", "time"], rows, numeric=(2,)) if rows else ""


def _losses(losses: dict[str, list[str]]) -> str:
    items = "".join(f"<dt><code>{_text(file)}</code></dt><dd>{_text('; '.join(lines))}</dd>" for file, lines in losses.items())
    return f'<h2>What each file leaves out</h2><dl class="losses">{items}</dl>'


def _table(head: list[str], rows: list[list[str]], numeric: tuple[int, ...] = ()) -> str:
    def cells(tag: str, values: list[str]) -> str:
        marks = [' class="number"' if k in numeric else "" for k in range(len(values))]
        return "".join(f"<{tag}{mark}>{value}</{tag}>" for mark, value in zip(marks, values, strict=True))

    lines = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return f'<div class="scroll"><table><thead><tr>{cells("th", head)}</tr></thead><tbody>{lines}</tbody></table></div>'


def _severity(severity: str) -> str:
    return f'<span class="badge {"bad" if severity == "error" else "warn"}">{_text(severity)}</span>'


def _judged(value: str, good: bool) -> str:
    return f'<span class="{"" if good else "wrong"}">{value}</span>'


def _percent(value: float | None) -> str:
    return "–" if value is None else f"{100 * value:.0f} %"


def _millimetres(value: float | None) -> str:
    return "–" if value is None else f"{1000 * value:.1f} mm"


def _text(value: object) -> str:
    return html.escape(str(value), quote=True)


_SHORT = {"measured": "m", "inferred": "i", "default": "d", "person": "p"}

_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src 'self' file:; style-src 'unsafe-inline'">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
<main>
{body}
</main>
</body>
</html>
"""

_STYLE = """
:root { color-scheme: light dark; --ink: #22262b; --quiet: #667079; --line: #e1e5e9; --paper: #fff; --tile: #f5f6f8;
  --good: #13693a; --good-paper: #e0f3e8; --bad: #a3211c; --bad-paper: #fbe4e2; --warn: #7a5200; --warn-paper: #fdf0d3; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e9ec; --quiet: #9aa4ae; --line: #363d44; --paper: #1b1f23;
  --tile: #24292e; --good: #7fd6a4; --good-paper: #153524; --bad: #ff9d96; --bad-paper: #451c1a; --warn: #f3cb7b;
  --warn-paper: #3c2f12; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink); font: 15px/1.5 system-ui, sans-serif; }
main { max-width: 1080px; margin: 0 auto; padding: 32px 24px 64px; }
h1 { margin: 0; font-size: 28px; overflow-wrap: anywhere; }
h2 { margin: 40px 0 12px; font-size: 18px; }
header p { margin: 6px 0 0; }
.quiet, small { color: var(--quiet); font-size: 13px; }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(132px, 1fr)); gap: 10px; margin: 24px 0; }
.tiles div { background: var(--tile); border-radius: 8px; padding: 10px 12px; }
.tiles dt { color: var(--quiet); font-size: 13px; }
.tiles dd { margin: 2px 0 0; font-size: 20px; font-variant-numeric: tabular-nums; white-space: nowrap; }
figure { margin: 0; }
.wide img { width: 100%; height: auto; border-radius: 8px; border: 1px solid var(--line); display: block; }
.thumb { width: 200px; height: auto; border-radius: 4px; display: block; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; }
th { text-align: left; font-weight: 600; font-size: 13px; color: var(--quiet); }
th, td { padding: 8px 10px; border-bottom: 1px solid var(--line); vertical-align: top; }
.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
td ul { margin: 0; padding-left: 18px; }
.sizes { white-space: nowrap; }
sup { color: var(--quiet); font-size: 11px; }
code { font: 13px/1.4 ui-monospace, monospace; overflow-wrap: anywhere; }
.badge { display: inline-block; padding: 1px 9px; border-radius: 10px; font-size: 13px; white-space: nowrap; }
.good { color: var(--good); background: var(--good-paper); }
.bad { color: var(--bad); background: var(--bad-paper); }
.warn { color: var(--warn); background: var(--warn-paper); }
.none { color: var(--quiet); background: var(--tile); }
.wrong { color: var(--bad); font-weight: 600; }
.losses dt { margin-top: 8px; }
.losses dd { margin: 2px 0 0; }
"""
