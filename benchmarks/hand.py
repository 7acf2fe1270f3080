"""Keystroke-level model of the time that a person's hands are busy, over a page of Playwright.

Card, Moran and Newell (1980), "The keystroke-level model for user performance time with interactive systems", CACM 23(7):
pointing 1.1 s, pressing or releasing a button 0.1 s, a key 0.28 s (an average typist; 0.3 here), moving a hand between mouse
and keyboard 0.4 s, mental preparation 1.35 s before each step. A hand on single keys need not move: the other one stays at the
mouse. Computing time is not hand time. The pointer misses its target by a Gaussian of TREMOR_PX on each axis.
"""

from dataclasses import dataclass, field

import numpy as np
from playwright.sync_api import Locator, Page

POINT_S, BUTTON_S, KEY_S, HAND_S, MIND_S = 1.1, 0.1, 0.3, 0.4, 1.35
TREMOR_PX = 1.5  # standard deviation


@dataclass(slots=True)
class Hand:
    """A simulated person's actions, and the seconds they take."""

    page: Page
    rng: np.random.Generator
    seconds: float = 0.0
    counts: dict[str, int] = field(default_factory=lambda: dict.fromkeys(("points", "presses", "keys", "thoughts"), 0))

    def think(self) -> None:
        """Mental preparation."""
        self._spend("thoughts", MIND_S)

    def click(self, target: Locator) -> None:
        """Point at a control and click it."""
        self.click_elsewhere()
        target.click()

    def click_elsewhere(self) -> None:
        """Point and click at something outside the page."""
        self._spend("points", POINT_S)
        self._spend("presses", 2 * BUTTON_S)

    def point(self, x: float, y: float) -> None:
        """Point at a screen position, in pixels."""
        self._spend("points", POINT_S)
        self.page.mouse.move(*(np.array([x, y]) + self.rng.normal(0, TREMOR_PX, 2)).tolist(), steps=3)

    def press_at(self, x: float, y: float) -> None:
        """Point at a screen position and click."""
        self.point(x, y)
        self._button(down=True)
        self._button(down=False)

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Drag from one screen position to another."""
        self.point(*start)
        self._button(down=True)
        self.point(*end)
        self._button(down=False)

    def key(self, key: str) -> None:
        """Press one key, with its modifiers."""
        for _ in key.split("+"):
            self._spend("keys", KEY_S)
        self.page.keyboard.press(key)

    def write(self, text: str) -> None:
        """Type into the focused field, with both hands on the keyboard, and press Enter."""
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
