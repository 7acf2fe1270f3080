"""The evaluation as text for a terminal."""

from collections.abc import Sequence

from r2c2r_core.model.report import Metric
from r2c2r_core.texts import shown

_COLUMNS = (
    ("mask_iou", "mask IoU", "{:.3f}"),
    ("width_error", "w %", "{:.1f}"),
    ("depth_error", "d %", "{:.1f}"),
    ("height_error", "h %", "{:.1f}"),
    ("extents_observed", "observed %", "{:.1f}"),
    ("centre", "centre mm", "{:.0f}"),
    ("front_centre", "front mm", "{:.0f}"),
    ("yaw", "yaw deg", "{:.1f}"),
    ("joint_type", "type", "{:.2f}"),
    ("hinge_side", "hinge", "{:.2f}"),
    ("axis", "axis deg", "{:.2f}"),
    ("pivot", "pivot mm", "{:.0f}"),
    ("range_ratio", "range", "{:.2f}"),
    ("state", "states", "{:.2f}"),
    ("state_open", "open", "{:.2f}"),
    ("inner_depth", "inner mm", "{:.0f}"),
    ("mask_iou_open", "open IoU", "{:.3f}"),
    ("box_iou", "box IoU", "{:.2f}"),
    ("scan_to_mesh_median", "scan mm", "{:.1f}"),
    ("f_score_1cm", "F 1 cm", "{:.2f}"),
    ("f_score_2cm", "F 2 cm", "{:.2f}"),
)


def to_text(rows: Sequence[tuple[str, str, Sequence[Metric]]], scene: Sequence[Metric]) -> str:
    """A table with one line per object and the means below; rows are (name, category, metrics)."""
    lines = [("object", "category", *(title for _, title, _ in _COLUMNS))]
    lines += [(shown(name), shown(category), *_cells(metrics)) for name, category, metrics in rows]
    lines.append(("mean", "", *_cells(scene)))
    widths = [max(len(line[column]) for line in lines) for column in range(len(lines[0]))]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if column < 2 else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in lines
    )


def _cells(metrics: Sequence[Metric]) -> list[str]:
    values = {metric.name: metric.value for metric in metrics}
    cells = []
    for name, _, form in _COLUMNS:
        value = values.get(name)
        cells.append("-" if value is None else form.format(value))
    return cells
