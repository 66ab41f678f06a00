// Light or dark: the address decides, then what was chosen last, then the system. Tells who draws by hand.
import { onPlace, place, settle } from "./url_state.js";
import { icon } from "./icons.js";

const KEY = "retake.theme";
const system = matchMedia("(prefers-color-scheme: dark)");
const listeners = new Set();

/** @returns {"light"|"dark"} */
export const theme = () => document.documentElement.dataset.theme;

/** Calls `listener` after the theme changed. @param {() => void} listener @returns {() => void} ends it */
export function onTheme(listener) {
  listeners.add(listener);
  return () => listeners.delete(listener);
}

/** A custom property of the style sheet, for what is drawn on a canvas. @param {string} name */
export const color = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** @param {HTMLButtonElement} button */
export function startTheme(button) {
  const apply = () => {
    const chosen = place().theme || localStorage.getItem(KEY);
    const next = chosen === "light" || chosen === "dark" ? chosen : system.matches ? "dark" : "light";
    button.replaceChildren(icon(next === "dark" ? "sun" : "moon"));
    button.setAttribute("aria-label", next === "dark" ? "Light theme" : "Dark theme");
    button.title = button.getAttribute("aria-label");
    if (next === theme()) return;
    document.documentElement.dataset.theme = next;
    for (const listener of listeners) listener();
  };
  button.addEventListener("click", () => {
    const next = theme() === "dark" ? "light" : "dark";
    localStorage.setItem(KEY, next);
    settle({ theme: next });
  });
  system.addEventListener("change", apply);
  onPlace(apply);
  apply();
}
