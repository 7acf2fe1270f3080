/** Small DOM helpers. Text is inserted with textContent, never as markup. */

/**
 * Create an element: `on…` functions become listeners, dashed names and a few more attributes, others properties.
 * @template {keyof HTMLElementTagNameMap} K
 * @param {K} tag
 * @param {Record<string, unknown>} [props]
 * @param {...(Node | string | null | undefined | false)} children
 * @returns {HTMLElementTagNameMap[K]}
 */
export function h(tag, props = {}, ...children) {
  const element = document.createElement(tag);
  assign(element, props);
  element.append(...children.filter((child) => child !== null && child !== undefined && child !== false));
  return element;
}

/**
 * @param {Element} element
 * @param {Record<string, unknown>} props
 */
function assign(element, props) {
  for (const [name, value] of Object.entries(props)) {
    if (value === undefined || value === null) continue;
    if (name.startsWith("on") && typeof value === "function") {
      element.addEventListener(name.slice(2).toLowerCase(), /** @type {EventListener} */ (value));
    } else if (name.includes("-") || ["role", "for", "list", "class", "sandbox"].includes(name)) {
      element.setAttribute(name, String(value));
    } else {
      Reflect.set(element, name, value);
    }
  }
}

/**
 * An icon of icons/sprite.svg, hidden from assistive technology (the button carries the label).
 * @param {string} name
 */
export function icon(name) {
  const use = shape("use", { href: import.meta.resolve(`../icons/sprite.svg#${name}`) });
  return shape("svg", { class: "icon", "aria-hidden": "true" }, use);
}

/**
 * An SVG element with its attributes.
 * @template {keyof SVGElementTagNameMap} K
 * @param {K} tag
 * @param {Record<string, string | number>} [attributes]
 * @param {...(Node | string)} children
 * @returns {SVGElementTagNameMap[K]}
 */
export function shape(tag, attributes = {}, ...children) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, String(value));
  made.append(...children);
  return made;
}

/** A turning wheel with what is being waited for. @param {string} text */
export function spinner(text) {
  return h("div", { class: "spinner", role: "status" }, h("span", { class: "wheel", "aria-hidden": "true" }), text);
}

/**
 * A labelled field for a number.
 * @param {string} text
 * @param {number} value
 * @param {Record<string, string>} options
 */
export function numberField(text, value, options) {
  const input = h("input", { type: "number", value: String(Math.round(10 * value) / 10), ...options });
  return { input, label: h("label", {}, h("span", { class: "muted" }, text), input) };
}

/**
 * Segmented control: a group of toggle buttons, one or several of them pressed.
 * @param {string} label
 * @param {...HTMLElement} buttons
 */
export function segments(label, ...buttons) {
  return h("div", { class: "segments", role: "group", "aria-label": label }, ...buttons);
}

/** Scroll a row into view within its scrolling list; the page itself is not scrolled. @param {Element | null} line */
export function reveal(line) {
  const around = line?.closest(".scrolled");
  if (!line || !around || around.scrollHeight <= around.clientHeight) return;
  const [box, room] = [line.getBoundingClientRect(), around.getBoundingClientRect()];
  if (box.top < room.top) around.scrollTop -= room.top - box.top;
  else if (box.bottom > room.bottom) around.scrollTop += Math.min(box.bottom - room.bottom, box.top - room.top);
}

/**
 * A slider with its name before it, which is hidden where there is no room.
 * @param {string} text
 * @param {HTMLInputElement} input that has a label of its own
 */
export function slider(text, input) {
  return h("label", { class: "slider", title: text }, h("span", {}, text), input);
}

/** Button, link or summary on which a pointer is held down. @type {Node | null} */
let pressed = null;
/** Children to be inserted once it is released, by their parent. @type {Map<HTMLElement, (Node | string)[]>} */
const waiting = new Map();

addEventListener(
  "pointerdown",
  ({ target }) => (pressed = target instanceof Element ? target.closest("button, a, summary") : null),
  true,
);
for (const type of ["pointerup", "pointercancel"]) addEventListener(type, () => setTimeout(release), true); // after its click
addEventListener("click", () => (pressed = null), true); // changes made by the click are drawn at once
addEventListener("blur", release); // of the window: a release outside it fires no event

function release() {
  pressed = null;
  const late = [...waiting];
  waiting.clear();
  for (const [parent, children] of late) renew(parent, ...children);
}

/**
 * Replace the children of an element. Keyboard focus, or any focus in a field, moves to the child with the same `data-at`,
 * "what:which", else to the next one of the same "what"; a text selection is restored. While a button in the parent is held
 * down, the replacement waits: a browser fires a click only on an element that is present from press to release.
 * @param {HTMLElement} parent
 * @param {...(Node | string)} children
 */
export function renew(parent, ...children) {
  if (pressed && parent.contains(pressed)) {
    waiting.set(parent, children);
    return;
  }
  waiting.delete(parent);
  const at = parent.querySelector("[data-at]:is(:focus-visible, input:focus)");
  const old = at instanceof HTMLElement ? (at.dataset.at ?? "") : "";
  const alike = `[data-at^="${CSS.escape(old.split(":")[0] ?? "")}:"]`;
  const place = at ? [...parent.querySelectorAll(alike)].indexOf(at) : -1;
  const selected =
    at instanceof HTMLInputElement && at.selectionStart !== null ? [at.selectionStart, at.selectionEnd] : [];
  parent.replaceChildren(...children);
  if (!at) return;
  const now = /** @type {HTMLElement[]} */ ([...parent.querySelectorAll(alike)]);
  const next = now.find((one) => one.dataset.at === old) ?? now[Math.min(place, now.length - 1)];
  next?.focus({ preventScroll: true });
  const [from, to] = selected;
  if (next instanceof HTMLInputElement && next.selectionStart !== null && from !== undefined)
    next.setSelectionRange(from, to ?? from);
}

/** An element whose listeners, fetches and timers end when it leaves the page. */
export class LiveElement extends HTMLElement {
  #controller = new AbortController();

  /** Aborted when the element leaves the page. */
  get signal() {
    return this.#controller.signal;
  }

  connectedCallback() {
    if (this.#controller.signal.aborted) this.#controller = new AbortController();
    this.connected();
  }

  disconnectedCallback() {
    this.#controller.abort();
  }

  /** Called when the element enters the page. */
  connected() {}

  /**
   * Dispatch an event that bubbles to the parents.
   * @param {string} type
   * @param {unknown} [detail]
   */
  emit(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail, bubbles: true, composed: true }));
  }
}

/**
 * Listen to pointer and wheel events of a canvas, and to size changes of the element it fills, while that is on the page.
 * @param {LiveElement} element
 * @param {HTMLCanvasElement} canvas
 * @param {{
 *   down: (event: PointerEvent) => void, move: (event: PointerEvent) => void, up: (event: PointerEvent) => void,
 *   cancel: (event: PointerEvent) => void, wheel: (event: WheelEvent) => void, resized: () => void,
 * }} handlers
 */
export function wire(element, canvas, { down, move, up, cancel, wheel, resized }) {
  const { signal } = element;
  canvas.addEventListener("pointerdown", down, { signal });
  canvas.addEventListener("pointermove", move, { signal });
  canvas.addEventListener("pointerup", up, { signal });
  canvas.addEventListener("pointercancel", cancel, { signal });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault(), { signal });
  canvas.addEventListener("wheel", wheel, { signal, passive: false });
  const observer = new ResizeObserver(resized);
  observer.observe(element);
  signal.addEventListener("abort", () => observer.disconnect());
}

/**
 * The detail of a custom event.
 * @template T
 * @param {Event} event
 * @returns {T}
 */
export function detailOf(event) {
  return /** @type {CustomEvent<T>} */ (event).detail;
}
