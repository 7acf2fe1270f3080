"""Concurrent tasks on one connection."""

import contextlib
from collections.abc import Awaitable, Callable

import anyio
from starlette.websockets import WebSocketDisconnect

Work = Callable[[], Awaitable[object]]


async def until_first(*works: Work) -> int:
    """Run all until one of them or its connection ends, then cancel the others; returns the index of the first."""
    ended: list[int] = []

    async def follow(number: int, work: Work) -> None:
        with contextlib.suppress(WebSocketDisconnect, RuntimeError):  # raised by Starlette on a closed connection
            await work()
        ended.append(number)
        group.cancel_scope.cancel()

    async with anyio.create_task_group() as group:
        for number, work in enumerate(works):
            group.start_soon(follow, number, work)
    return ended[0]
