"""The capture doctor: quality assessment of a recording, with reasons and advice."""

from r2c2r_core.ingest.doctor.examine import examine
from r2c2r_core.ingest.doctor.picture import draw_scan, side_by_side
from r2c2r_core.ingest.doctor.report import CaptureFigures, CaptureReport, Remark, refusal_to_json

__all__ = ["CaptureFigures", "CaptureReport", "Remark", "draw_scan", "examine", "refusal_to_json", "side_by_side"]
