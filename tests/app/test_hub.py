import asyncio

from app.hub import QUEUE_LIMIT, Hub, Listener


def test_a_listener_gets_what_it_missed_while_it_is_remembered() -> None:
    async def scene() -> None:
        hub = Hub(keep=3)
        first, _ = hub.join("p", None, None)
        for number in range(5):
            hub.publish("object", "p", number=number)
        await asyncio.sleep(0)
        assert [first.queue.get_nowait()["seq"] for _ in range(5)] == [1, 2, 3, 4, 5]
        second, must_fetch = hub.join("p", 2, hub.epoch)
        assert ([second.queue.get_nowait()["seq"] for _ in range(3)], must_fetch) == ([3, 4, 5], False)
        _, must_fetch = hub.join("p", 1, hub.epoch)
        assert must_fetch  # message 2 is forgotten
        _, must_fetch = hub.join("p", 5, "another epoch")
        assert must_fetch
        _, must_fetch = hub.join("p", 0, "")
        assert not must_fetch

    asyncio.run(scene())


def test_a_tab_hears_of_its_own_project_and_of_every_job() -> None:
    async def scene() -> None:
        hub = Hub()
        listener, _ = hub.join("mine", None, None)
        for kind, project in (("mask", "other"), ("mask", "mine"), ("job", "other"), ("projects", None)):
            hub.publish(kind, project)
        await asyncio.sleep(0)
        assert [listener.queue.get_nowait()["type"] for _ in range(listener.queue.qsize())] == ["mask", "job", "projects"]
        hub.leave(listener)
        hub.publish("job", "mine")
        await asyncio.sleep(0)
        assert listener.queue.empty()

    asyncio.run(scene())


def test_a_tab_that_does_not_keep_up_is_told_to_fetch_everything_anew() -> None:
    async def scene() -> None:
        hub = Hub()
        listener, _ = hub.join(None, None, None)
        for _ in range(QUEUE_LIMIT + 1):
            hub.publish("job", None)
        await asyncio.sleep(0)
        message = listener.queue.get_nowait()
        assert (message["type"], message["reset"], message["seq"]) == ("hello", True, QUEUE_LIMIT + 1)
        assert listener.queue.empty()

    asyncio.run(scene())


def test_everybody_at_a_project_knows_who_else_is_there_and_on_what() -> None:
    async def scene() -> None:
        hub = Hub()
        ann, _ = hub.join("kitchen", None, None, "ann")
        bob, _ = hub.join(None, None, None, "bob")
        hub.move(bob, "kitchen", "annotate", 7)
        await asyncio.sleep(0)
        both = {("ann", "", None), ("bob", "annotate", 7)}
        assert _told(ann) == both
        assert _told(bob) == both
        hub.leave(bob)
        await asyncio.sleep(0)
        assert _told(ann) == {("ann", "", None)}
        hub.publish("object", "kitchen")
        again, _ = hub.join("kitchen", 0, hub.epoch, "eve")
        await asyncio.sleep(0)
        kinds = [again.queue.get_nowait()["type"] for _ in range(again.queue.qsize())]
        assert kinds == ["object", "presence"]  # of presence only what is now

    asyncio.run(scene())


def _told(listener: Listener) -> set[tuple[str, str, int | None]]:
    """Who is here by the last message."""
    messages = [listener.queue.get_nowait() for _ in range(listener.queue.qsize())]
    assert messages[-1]["type"] == "presence"
    return {(each["who"], each["page"], each["object"]) for each in messages[-1]["people"]}
