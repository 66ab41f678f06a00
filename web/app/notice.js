// Calm words at the foot of the page: what failed, what was done. And the banner while the server is gone.
import { h, say } from "./dom.js";
import { on } from "./live.js";
import { Problem } from "./api.js";

const SIGNS = { connecting: "Connecting", live: "Live", asking: "Looks for news every few seconds", gone: "Not connected" };
const LASTS = 9000; // [ms], time to read a sentence or two
const box = document.getElementById("notices");

/** @param {string} text @param {"plain"|"bad"} [kind] */
export function notice(text, kind = "plain") {
  const line = h(`p.notice.${kind}`, {}, text);
  // Shown anew, so that it lies above a dialog that was opened meanwhile.
  if (box.matches(":popover-open")) box.hidePopover();
  box.showPopover();
  box.append(line);
  setTimeout(() => {
    line.remove();
    if (!box.children.length) box.hidePopover();
  }, LASTS);
}

/** Says that a parameter of the address has no meaning. @param {string} name @param {string} value */
export const senseless = (name, value) => notice(`The address says ${name} = “${value.slice(0, 60)}”, which means nothing here; it is left out.`, "bad");

/** Says why something was refused; silent when the server is gone, which the banner says. @param {any} error */
export function complain(error) {
  if (error.name === "AbortError" || (error instanceof Problem && error.status === 0)) return;
  if (!(error instanceof Problem)) throw error;
  notice([error.message, ...error.errors.map((fault) => `${fault.pointer} ${fault.detail}`)].join(" – "), "bad");
}

/** @param {HTMLElement} banner @param {HTMLElement} dot */
export function startConnectionSigns(banner, dot) {
  let patience = 0;
  on("connection", (state) => {
    clearTimeout(patience);
    dot.dataset.state = state;
    dot.title = SIGNS[state];
    if (state !== "gone") banner.hidden = true;
    // A restart within a second or two is nobody's business.
    else patience = setTimeout(() => show(banner), 1500);
  });
}

function show(banner) {
  say(banner, "The server is out of reach. This page stays as it is and connects again by itself.");
  banner.hidden = false;
}
