"""Types of numbers in addresses, within the database's limits, and of body sizes."""

from typing import Annotated

from fastapi import Path, Query

STREAMED = 2**53  # bytes of a streamed body, limited by the service
RowId = Annotated[int, Path(ge=0, lt=2**63)]
FrameNumber = Annotated[int, Path(ge=0, lt=2**31)]
Count = Annotated[int, Query(ge=0, lt=2**31)]
OptionalId = Annotated[int | None, Query(ge=0, lt=2**63)]
OtherId = Annotated[int, Query(ge=0, lt=2**63)]  # of a second row, in the query
