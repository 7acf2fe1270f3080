"""Variants of bundles for training."""

from typing import Annotated

from fastapi import Path
from pydantic import Field

from app.schemas.base import Shape

MOST_VARIANTS = 1000
"""At a time: as many were measured (benchmarks/variants.json), 9 minutes on two busy cores. The command line makes more."""

VariantsName = Annotated[str, Path(pattern=r"^v\d+-n\d+-s\d+$", max_length=60)]


class VariantsIn(Shape):
    """Request for variants."""

    version: int = Field(ge=1, lt=2**31)  # of the bundle
    count: int = Field(ge=1, le=MOST_VARIANTS)
    seed: int = Field(default=0, ge=0, lt=2**31)


class VariantsOffer(Shape):
    """Estimated size of variants of the newest bundle."""

    version: int
    most: int  # at a time
    zip_bytes: int  # about, of what they share; as what follows
    each_zip_bytes: int  # of each variant
    disk_bytes: int  # beside the zip while they are made, of what they share
    each_disk_bytes: int  # of each variant
    free_bytes: int  # on the disk, for a job to fill


class VariantSet(Shape):
    """Variants that were made together."""

    name: str
    version: int  # of the bundle
    count: int
    seed: int
    url: str
    file_name: str
    wall: str  # address of a picture of the first of them
    sha256: str
    size: int
    created: float
    rejected: dict[str, int]  # draws, by why
    checked: int  # by the whole simulation certificate
    failed: list[str]  # of them, by their names in the zip


class Variants(Shape):
    """All that were made of a project's bundles, and what more would take."""

    offer: VariantsOffer | None  # None: there is no bundle that can be varied
    sets: list[VariantSet]  # newest first
