/**
 * Roving tabindex of a toolbar: Tab stops at its first button only; arrow keys, Home and End reach the others.
 * @param {HTMLElement} bar
 */
export function rove(bar) {
  const all = () => [...bar.querySelectorAll("button")];
  const stopAt = (/** @type {Element | undefined} */ stop) => {
    for (const button of all()) button.tabIndex = button === stop ? 0 : -1;
  };
  bar.addEventListener("focusin", ({ target }) => target instanceof HTMLButtonElement && stopAt(target));
  bar.addEventListener("focusout", ({ relatedTarget }) => {
    if (!(relatedTarget instanceof Node && bar.contains(relatedTarget))) stopAt(all()[0]);
  });
  bar.addEventListener("keydown", (event) => {
    const at = event.target;
    if (!(at instanceof HTMLButtonElement) || !at.matches(":focus-visible")) return;
    const able = all().filter((button) => !button.disabled && button.checkVisibility());
    const step = { ArrowDown: 1, ArrowRight: 1, ArrowUp: -1, ArrowLeft: -1 }[event.key];
    const next = step ? able[able.indexOf(at) + step] : { Home: able[0], End: able.at(-1) }[event.key];
    if (!next && !step) return;
    event.preventDefault();
    event.stopPropagation();
    next?.focus();
  });
  stopAt(all()[0]);
}
