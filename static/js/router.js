/** Router: page, project and query of an address, and navigation between pages. */

/** @typedef {{ page: string, project: string | null, query: URLSearchParams }} Route */

const ALONE = ["inbox", "people", "templates", "webhooks"]; // pages outside a project
const PAGES = ["annotate", "elevation", "run", "review", "download", "agreement"];

/**
 * @param {URL | Location} address
 * @returns {Route}
 */
export function routeOf(address) {
  const [first, project, page] = address.pathname.split("/").filter(Boolean);
  const query = new URLSearchParams(address.search);
  if (first && ALONE.includes(first)) return { page: first, project: null, query };
  if (first !== "p" || !project) return { page: "projects", project: null, query };
  return { page: page && PAGES.includes(page) ? page : "overview", project, query };
}

/**
 * Follow links inside the app without reloading, and call `show` when the page changes.
 * @param {(route: Route) => void} show
 */
export function startRouter(show) {
  document.addEventListener("click", (event) => {
    const link = event.composedPath().find((node) => node instanceof HTMLAnchorElement);
    if (!(link instanceof HTMLAnchorElement) || event.defaultPrevented || event.button !== 0) return;
    if (event.ctrlKey || event.metaKey || event.shiftKey || link.target || link.hasAttribute("download")) return;
    const url = new URL(link.href);
    const ours = ["", ...ALONE].includes(url.pathname.slice(1)) || url.pathname.startsWith("/p/");
    if (url.origin !== location.origin || !ours) return;
    event.preventDefault();
    go(url.pathname + url.search);
  });
  window.addEventListener("popstate", () => show(routeOf(location)));
  window.addEventListener("r2c2r-go", () => show(routeOf(location)));
  show(routeOf(location));
}

/** @param {string} path */
export function go(path) {
  history.pushState(null, "", path);
  window.dispatchEvent(new Event("r2c2r-go"));
}

/**
 * Change the query without leaving the page or growing the history, so that the address can be shared.
 * @param {Record<string, string | number | null>} values
 */
export function remember(values) {
  const url = new URL(location.href);
  for (const [name, value] of Object.entries(values)) {
    if (value === null) url.searchParams.delete(name);
    else url.searchParams.set(name, String(value));
  }
  history.replaceState(null, "", url);
  window.dispatchEvent(new Event("r2c2r-remember"));
}
