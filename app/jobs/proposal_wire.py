"""Encoding of proposals in the API and in the project's folder."""

import hashlib
import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from app.jobs.mask_wire import mask_bits
from r2c2r_core.arrays import Mask
from r2c2r_core.geometry.masks import unpack_mask
from r2c2r_core.model.proposal import Proposal
from r2c2r_core.workspace import write_atomically

_SMOOTH = 0.002  # tolerance of the outline's simplification, as a fraction of the frame's width


def proposal_line(proposal: Proposal, preview_width: int) -> dict[str, Any]:
    """The proposal as schemas.Proposal, with its mask at preview size under "mask"."""
    click = proposal.click
    content = json.dumps([click.frame, click.x, click.y])
    return {
        "id": hashlib.sha256(content.encode()).hexdigest()[:12],
        "kind": proposal.kind,
        "category": proposal.category,
        "confidence": proposal.confidence,
        "frame": click.frame,
        "x": click.x,
        "y": click.y,
        "size_m": [round(float(side), 3) for side in proposal.size_m],
        "outline": _outline(unpack_mask(proposal.outline)),
        "doubts": list(proposal.doubts),
        "handle": [list(corner) for corner in proposal.handle_px],
        "mask": mask_bits(proposal.outline, preview_width),
    }


def write_proposals(path: Path, fraction: float, lines: list[dict[str, Any]]) -> None:
    """Store the proposals found so far, with the completed fraction of the search."""
    write_atomically(path, json.dumps({"fraction": fraction, "proposals": lines}).encode())


def read_proposals(path: Path) -> tuple[float, list[dict[str, Any]]]:
    """Completed fraction of the search (1: all are known) and the proposals, as stored; none where the file is unreadable."""
    try:
        stored = json.loads(path.read_text())
        return float(stored["fraction"]), list(stored["proposals"])
    except (FileNotFoundError, ValueError, KeyError, TypeError):
        return 0.0, []


def _outline(mask: Mask) -> list[list[float]]:
    """The border of the mask's largest part, in pixels of the frame."""
    contours, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    if not contours:
        return []
    border = cv2.approxPolyDP(max(contours, key=cv2.contourArea), _SMOOTH * mask.shape[1], closed=True)
    return [[float(x) + 0.5, float(y) + 0.5] for x, y in border[:, 0]]
