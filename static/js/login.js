/** The sign-in page: a password becomes a session, and the page that was asked for opens. */

import { ApiError, signIn } from "./api.js";
import { nextPage } from "./lib/next-page.js";

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
    location.assign(nextPage(new URLSearchParams(location.search).get("next"), location.origin));
  } catch (error) {
    alertLine.textContent = error instanceof ApiError ? `${error.message}: ${error.hint}` : String(error);
  }
});
