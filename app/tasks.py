"""Things that go on side by side on one connection."""

import contextlib
from collections.abc import Awaitable, Callable

import anyio
from starlette.websockets import WebSocketDisconnect

Work = Callable[[], Awaitable[object]]


async def until_first(*works: Work) -> int:
    """Do all of them until one comes to its end, or its connection does; then stop the others. Which one that was."""
    ended: list[int] = []

    async def follow(number: int, work: Work) -> None:
        with contextlib.suppress(WebSocketDisconnect, RuntimeError):  # what Starlette says of a connection that is closed
            await work()
        ended.append(number)
        group.cancel_scope.cancel()

    async with anyio.create_task_group() as group:
        for number, work in enumerate(works):
            group.start_soon(follow, number, work)
    return ended[0]
