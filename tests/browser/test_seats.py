"""Activity of each seat, on the page People."""

from playwright.sync_api import expect

from tests.browser.looks import picture, scroll_to
from tests.browser.serving import NewContext
from tests.browser.together import Server, signed_in


def test_the_seat_list_names_the_objects_of_a_helping_seat(new_context: NewContext, server: Server) -> None:
    context = new_context()
    page = signed_in(context, server, "ann")
    job = {"id": 7, "project_id": "p", "project_name": "Kitchen A", "kind": "run", "stage": "generate", "progress": 0.4}
    seat = {"version": "1", "jobs_at_a_time": 1, "began": 1.0, "silent_s": 0.0, "draining": False, "here": False}
    seats = [
        {**seat, "id": 1, "host": "gpu-1", "process": 11, "jobs": [{**job, "objects": []}]},
        {**seat, "id": 2, "host": "gpu-2", "process": 12, "jobs": [{**job, "objects": ["drawer_1", "mug_1"]}]},
    ]
    page.route("**/api/seats", lambda route: route.fulfill(json={"waiting": 0, "shared": True, "seats": seats}))
    page.goto(f"{server.address}/people")
    rows = page.locator("r2c2r-seat-list tbody tr")
    expect(rows.nth(0)).to_contain_text("Kitchen A generate, 40 %")
    expect(rows.nth(1)).to_contain_text("Kitchen A generate, helps: drawer_1, mug_1")
    scroll_to(rows.nth(1))
    picture(page, "seats")
