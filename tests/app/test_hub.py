import asyncio
import json
from typing import Any

import pytest

from app import hub as hubs
from app.hub import Hub, Listener


@pytest.fixture(autouse=True)
def presence_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hubs, "PRESENCE_S", 0.0)


def test_a_listener_receives_missed_messages_that_are_still_buffered(monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene() -> None:
        hub = Hub()
        first = hub.join("p", None, None)
        for number in range(5):
            hub.publish("object", "p", number=number)
        await asyncio.sleep(0)
        (size,) = {len(text) for text in list(first.queue._queue)[2:]}  # type: ignore[attr-defined]
        assert [each["seq"] for each in told(first, "object")] == [1, 2, 3, 4, 5]
        monkeypatch.setattr(hubs, "KEPT_BYTES", 3 * size + 1)
        hub.publish("object", "p", number=5)
        second = hub.join("p", 3, hub.epoch)
        assert [(each["seq"], each.get("reset")) for each in told(second, "hello", "object")] == [
            (6, False), (4, None), (5, None), (6, None),
        ]  # fmt: skip
        assert resets(hub, 2)  # message 3 is no longer buffered
        assert resets(hub, 5, "another epoch")
        assert not resets(hub, 0, "")

    asyncio.run(scene())


def test_the_message_buffer_is_bounded_in_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hubs, "KEPT_BYTES", 10_000)

    async def scene() -> None:
        hub = Hub()
        for size in (10, 9_000, 5_000, 20_000, 10, 3_000):
            hub.publish("mask", "p", bits="x" * size)
            assert sum(len(message.text) for message in hub._recent) <= 10_000
        assert [len(json.loads(message.text)["bits"]) for message in hub._recent] == [10, 3_000]

    asyncio.run(scene())


def test_a_tab_receives_messages_of_its_own_project_and_of_every_job() -> None:
    async def scene() -> None:
        hub = Hub()
        listener = hub.join("mine", None, None)
        for kind, project in (("mask", "other"), ("mask", "mine"), ("job", "other"), ("projects", None)):
            hub.publish(kind, project)
        await asyncio.sleep(0)
        assert [each["type"] for each in told(listener)] == ["hello", "project", "mask", "job", "projects"]
        hub.leave(listener)
        hub.publish("job", "mine")
        await asyncio.sleep(0)
        assert listener.queue.empty()

    asyncio.run(scene())


def test_a_tab_entering_a_project_receives_a_project_message_once() -> None:
    async def scene() -> None:
        hub = Hub()
        listener = hub.join(None, None, None)
        hub.publish("project", "kitchen")  # after the tab has loaded it, before it reports its page
        hub.move(listener, "kitchen", "overview", None)
        hub.move(listener, "kitchen", "overview", 1)
        await asyncio.sleep(0)
        assert [(each["type"], each["project"]) for each in told(listener, "project")] == [("project", "kitchen")]
        hidden = hub.join("kitchen", None, None, sees=lambda project: project is None)
        await asyncio.sleep(0)
        assert told(hidden, "project") == []

    asyncio.run(scene())


def test_a_tab_that_falls_behind_receives_a_reset(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hubs, "WAITING_BYTES", 1_000)

    async def scene() -> None:
        hub = Hub()
        listener = hub.join(None, None, None)
        for _ in range(3):
            hub.publish("job", None, text="x" * 300)
        await asyncio.sleep(0)
        (message,) = told(listener)
        assert (message["type"], message["reset"], message["seq"]) == ("hello", True, 3)
        hub.publish("job", None, text="x" * 300)
        await asyncio.sleep(0)
        assert json.loads(await listener.next())["seq"] == 4

    asyncio.run(scene())


def test_messages_already_received_do_not_count_as_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hubs, "WAITING_BYTES", 1_000)

    async def scene() -> None:
        hub = Hub()
        listener = hub.join(None, None, None)
        await listener.next()
        for number in range(20):
            hub.publish("job", None, text="x" * 300)
            assert json.loads(await listener.next())["seq"] == number + 1

    asyncio.run(scene())


@pytest.mark.parametrize("text", ["\ud800", "é\U0001f600\x00", "\u2028</script>"])
def test_any_text_is_sent_as_ascii_and_decoded_unchanged(text: str) -> None:
    async def scene() -> None:
        hub = Hub()
        listener = hub.join("p", None, None)
        hub.publish("comments", "p", text=text)
        hub.tell(listener, "refused", message=text)
        await asyncio.sleep(0)
        raw = [listener.queue.get_nowait() for _ in range(4)][1:]
        assert all(each.encode("ascii") for each in raw)
        assert [json.loads(raw[1])["text"], json.loads(raw[2])["message"]] == [text, text]

    asyncio.run(scene())


def test_presence_lists_everyone_at_a_project_with_page_and_object() -> None:
    async def scene() -> None:
        hub = Hub()
        ann = hub.join("kitchen", None, None, "ann")
        bob = hub.join(None, None, None, "bob")
        hub.move(bob, "kitchen", "annotate", 7)
        both = {("ann", "", None), ("bob", "annotate", 7)}
        assert await here(ann) == both
        assert await here(bob) == both
        hub.leave(bob)
        assert await here(ann) == {("ann", "", None)}
        hub.publish("object", "kitchen")
        again = hub.join("kitchen", 0, hub.epoch, "eve")
        await here(ann)
        assert [each["type"] for each in told(again)] == ["hello", "object", "presence"]  # of presence only the current state

    asyncio.run(scene())


def test_presence_is_sent_once_when_many_tabs_join_together() -> None:
    async def scene() -> None:
        hub = Hub()
        tabs = [hub.join("kitchen", None, None, f"p{number}") for number in range(300)]
        for tab in tabs:
            hub.move(tab, "kitchen", "annotate", 1)
        assert len(await here(tabs[0])) == 300
        assert {tab.queue.qsize() for tab in tabs[1:]} == {3}  # hello, project, presence

    asyncio.run(scene())


def test_an_outdated_state_that_arrives_late_is_not_sent() -> None:
    async def scene() -> None:
        hub = Hub()
        tab = hub.join("kitchen", None, None)
        for number, version in ((1, 2), (1, 1), (2, 1), (1, 2), (1, 3)):
            hub.publish_state("object", "kitchen", number, version, said=(number, version))
        await asyncio.sleep(0)
        assert [each["said"] for each in told(tab, "object")] == [[1, 2], [2, 1], [1, 2], [1, 3]]

    asyncio.run(scene())


def told(listener: Listener, *types: str) -> list[dict[str, Any]]:
    """The messages queued for a tab, of these types or all."""
    found = [json.loads(listener.queue.get_nowait()) for _ in range(listener.queue.qsize())]
    return [each for each in found if not types or each["type"] in types]


def resets(hub: Hub, since: int, epoch: str | None = None) -> bool:
    return bool(told(hub.join("p", since, hub.epoch if epoch is None else epoch), "hello")[0]["reset"])


async def here(listener: Listener) -> set[tuple[str, str, int | None]]:
    """The people present, from the next presence message."""
    while True:
        message = json.loads(await listener.next())
        if message["type"] == "presence":
            return {(each["who"], each["page"], each["object"]) for each in message["people"]}
