"""Numbers in addresses, within what the database can hold; bytes in bodies."""

from typing import Annotated

from fastapi import Path, Query

STREAMED = 2**53  # bytes of a body that is stored as it comes: the service knows the limit
RowId = Annotated[int, Path(ge=0, lt=2**63)]
FrameNumber = Annotated[int, Path(ge=0, lt=2**31)]
Count = Annotated[int, Query(ge=0, lt=2**31)]
OptionalId = Annotated[int | None, Query(ge=0, lt=2**63)]
OtherId = Annotated[int, Query(ge=0, lt=2**63)]  # of a second row, in the query
