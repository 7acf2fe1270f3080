"""Variants of bundles for training."""

from typing import Annotated

from fastapi import Path
from pydantic import Field

from app.schemas.base import Shape

MOST_VARIANTS = 1000
"""At a time: the largest measured number (benchmarks/variants.json), 9 minutes on two busy cores. The CLI makes more."""

VariantsName = Annotated[str, Path(pattern=r"^v\d+-n\d+-s\d+$", max_length=60)]


class VariantsIn(Shape):
    """Request for variants."""

    version: int = Field(ge=1, lt=2**31)  # of the bundle
    count: int = Field(ge=1, le=MOST_VARIANTS)
    seed: int = Field(default=0, ge=0, lt=2**31)


class VariantsOffer(Shape):
    """Estimated size of variants of the newest bundle."""

    version: int
    most: int  # maximum at a time
    zip_bytes: int  # approximate, of the shared part; as the following
    each_zip_bytes: int  # of each variant
    disk_bytes: int  # temporary, in addition to the zip, of the shared part
    each_disk_bytes: int  # of each variant
    free_bytes: int  # on the disk, available to a job


class VariantSet(Shape):
    """Variants made together by one job."""

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
    rejected: dict[str, int]  # rejected draws, by reason
    checked: int  # number tested by the full simulation certificate
    failed: list[str]  # of the tested ones, by their names in the zip


class Variants(Shape):
    """All variants of a project's bundles, and the estimated size of further ones."""

    offer: VariantsOffer | None  # None without a bundle that can be varied
    sets: list[VariantSet]  # newest first
