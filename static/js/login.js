/** The sign-in page: a password becomes a session, and the page that was asked for opens. */

import { ApiError, signIn } from "./api.js";

const form = /** @type {HTMLFormElement} */ (document.querySelector("form"));
const alertLine = /** @type {HTMLElement} */ (form.querySelector("[role=alert]"));
const theme = localStorage.getItem("theme");
if (theme) document.documentElement.dataset.theme = theme;

form.addEventListener("submit", async (event) => {
  event.preventDefault();
  const said = new FormData(form);
  alertLine.textContent = "";
  try {
    await signIn(String(said.get("name")), String(said.get("password")));
    location.assign(nextPage());
  } catch (error) {
    alertLine.textContent = error instanceof ApiError ? `${error.message}: ${error.hint}` : String(error);
  }
});

/** The page that was asked for, when it is one of ours. */
function nextPage() {
  const wanted = new URL(new URLSearchParams(location.search).get("next") ?? "/", location.origin);
  return wanted.origin === location.origin ? wanted.pathname + wanted.search : "/";
}
