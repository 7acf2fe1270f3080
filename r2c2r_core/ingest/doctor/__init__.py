"""The capture doctor: is this recording good enough, and if not, why not."""

from r2c2r_core.ingest.doctor.examine import examine
from r2c2r_core.ingest.doctor.report import CaptureFigures, CaptureReport, Remark

__all__ = ["CaptureFigures", "CaptureReport", "Remark", "examine"]
