/** Sign-in page: exchanges a password for a session, then opens the requested page. */

import { ApiError, signIn } from "./api.js";
import { nextPage } from "./lib/next-page.js";

const form = /** @type {HTMLFormElement} */ (document.querySelector("form"));
const alertLine = /** @type {HTMLElement} */ (form.querySelector("[role=alert]"));
const theme = localStorage.getItem("theme");
if (theme) document.documentElement.dataset.theme = theme;

if (new URLSearchParams(location.search).has("token")) {
  /** @type {HTMLElement} */ (document.querySelector("#used")).hidden = false;
  history.replaceState(null, "", "/login"); // remove the key from the address, so that a reload does not use it again
}

const provider = /** @type {HTMLAnchorElement} */ (document.querySelector("#provider"));
const wanted = new URLSearchParams(location.search).get("next");
if (wanted) provider.search = String(new URLSearchParams({ next: wanted }));

form.addEventListener("submit", async (event) => {
  event.preventDefault();
  const said = new FormData(form);
  const button = /** @type {HTMLButtonElement} */ (form.querySelector("button"));
  button.disabled = true; // after wrong passwords the server delays its response
  alertLine.textContent = "Signing in…";
  const waits = (/** @type {ApiError} */ error) =>
    (alertLine.textContent = `${error.message}: retrying in ${Math.ceil((error.retryMs ?? 0) / 1000)} s`);
  try {
    await signIn(String(said.get("name")), String(said.get("password")), waits);
    location.assign(nextPage(wanted, location.origin));
  } catch (error) {
    alertLine.textContent = error instanceof ApiError ? `${error.message}: ${error.hint}` : String(error);
    button.disabled = false;
  }
});
