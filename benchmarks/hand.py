"""How long a person's hand is busy: the keystroke-level model over a page of Playwright.

Card, Moran and Newell (1980), "The keystroke-level model for user performance time with interactive systems", CACM 23(7): to
point 1.1 s, to press or let go of a button 0.1 s, a key 0.28 s (an average typist; 0.3 here), a hand from the mouse to the
keyboard or back 0.4 s, and 1.35 s to make up one's mind before each thing done. A hand on single keys need not move: the other
one stays at the mouse. What the machine takes is no hand time. A pointer lands beside what it aims at, by TREMOR_PX each way.
"""

from dataclasses import dataclass, field

import numpy as np
from playwright.sync_api import Locator, Page

POINT_S, BUTTON_S, KEY_S, HAND_S, MIND_S = 1.1, 0.1, 0.3, 0.4, 1.35
TREMOR_PX = 1.5  # standard deviation


@dataclass(slots=True)
class Hand:
    """What a person does, and the seconds it takes them."""

    page: Page
    rng: np.random.Generator
    seconds: float = 0.0
    counts: dict[str, int] = field(default_factory=lambda: dict.fromkeys(("points", "presses", "keys", "thoughts"), 0))

    def think(self) -> None:
        """Make up one's mind."""
        self._spend("thoughts", MIND_S)

    def click(self, target: Locator) -> None:
        """A control."""
        self.click_elsewhere()
        target.click()

    def click_elsewhere(self) -> None:
        """Something that is no part of the page."""
        self._spend("points", POINT_S)
        self._spend("presses", 2 * BUTTON_S)

    def point(self, x: float, y: float) -> None:
        """At a place of the screen, pixels."""
        self._spend("points", POINT_S)
        self.page.mouse.move(*(np.array([x, y]) + self.rng.normal(0, TREMOR_PX, 2)).tolist(), steps=3)

    def press_at(self, x: float, y: float) -> None:
        """A click on a place of the screen."""
        self.point(x, y)
        self._button(down=True)
        self._button(down=False)

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """From a place to another with the button held."""
        self.point(*start)
        self._button(down=True)
        self.point(*end)
        self._button(down=False)

    def key(self, key: str) -> None:
        """One key, with those held beside it."""
        for _ in key.split("+"):
            self._spend("keys", KEY_S)
        self.page.keyboard.press(key)

    def write(self, text: str) -> None:
        """Into the field that has the focus, with both hands on the keyboard, and Enter."""
        self.seconds += 2 * HAND_S
        for letter in text:
            self.key("Space" if letter == " " else letter)
        self.key("Enter")

    def _button(self, *, down: bool) -> None:
        self._spend("presses", BUTTON_S)
        if down:
            self.page.mouse.down()
        else:
            self.page.mouse.up()

    def _spend(self, what: str, seconds: float) -> None:
        self.counts[what] += 1
        self.seconds += seconds
