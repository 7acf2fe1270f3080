"""The benchmark's numbers as Markdown, and against a baseline."""

from typing import Any

_COLUMNS = (
    ("objects_found", "objects", "{:.2f}"),
    ("mask_iou", "mask IoU", "{:.3f}"),
    ("extents_observed", "extents observed %", "{:.2f}"),
    ("joint_type", "joint types", "{:.2f}"),
    ("hinge_side", "hinge sides", "{:.2f}"),
    ("centre", "centre mm", "{:.0f}"),
    ("front_centre", "front centre mm", "{:.0f}"),
    ("yaw", "yaw deg", "{:.2f}"),
    ("scan_to_mesh_median", "scan to mesh mm", "{:.1f}"),
    ("certificate", "certificate", "{:.2f}"),
    ("cpu_minutes", "CPU minutes", "{:.1f}"),
    ("memory", "GB", "{:.1f}"),
)


def markdown(document: dict[str, Any]) -> str:
    """One line a seed, and their mean."""
    seeds: dict[str, dict[str, Any]] = document["seeds"]
    lines = ["| seed | " + " | ".join(title for _, title, _ in _COLUMNS) + " |", "|---" * (len(_COLUMNS) + 1) + "|"]
    for seed, metrics in seeds.items():
        lines.append(_line(seed, {name: _value(metrics, name) for name, _, _ in _COLUMNS}))
    lines.append(_line("mean", {name: _mean([_value(metrics, name) for metrics in seeds.values()]) for name, _, _ in _COLUMNS}))
    return "\n".join(lines)


def gate(document: dict[str, Any], baseline: dict[str, Any]) -> list[str]:
    """One line for every number that is worse than the baseline by more than its tolerance."""
    if (document["frames"], document["size"]) != (baseline["frames"], baseline["size"]):
        made = f"{baseline['frames']} frames of {'x'.join(str(side) for side in baseline['size'])}"
        return [f"the baseline was made with {made}: give the same --frames and --size"]
    worse = []
    for seed, metrics in document["seeds"].items():
        for name, old in baseline["seeds"].get(seed, {}).items():
            if old["value"] is None:
                continue
            value = _value(metrics, name)
            if value is None:
                worse.append(f"seed {seed}: {name} is missing, was {old['value']:.4g} {old['unit']}")
                continue
            loss = value - old["value"] if old["better"] == "lower" else old["value"] - value
            if loss > old["tolerance"] + 1e-9:
                worse.append(f"seed {seed}: {name} {value:.4g} {old['unit']}, was {old['value']:.4g} ± {old['tolerance']:.4g}")
    return worse


def _line(title: str, values: dict[str, float | None]) -> str:
    cells = []
    for name, _, form in _COLUMNS:
        value = values[name]
        cells.append("-" if value is None else form.format(value))
    return f"| {title} | " + " | ".join(cells) + " |"


def _value(metrics: dict[str, Any], name: str) -> float | None:
    value = metrics.get(name, {}).get("value")
    return None if value is None else float(value)


def _mean(values: list[float | None]) -> float | None:
    present = [value for value in values if value is not None]
    return sum(present) / len(present) if present else None
