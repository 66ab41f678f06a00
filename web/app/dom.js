// Building elements. The page's content security policy forbids markup with styles, and text stays text.

/**
 * @param {string} tag with classes: "button.primary"
 * @param {Object<string, any>} [props] `on…` listens, `data-…`/`aria-…`/`role` are attributes, the rest properties
 * @param {...(Node|string|number|null|undefined|false)} children
 * @returns {any}
 */
export function h(tag, props = {}, ...children) {
  const [name, ...classes] = tag.split(".");
  const element = document.createElement(name);
  if (classes.length) element.className = classes.join(" ");
  for (const [key, value] of Object.entries(props)) {
    if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
    else if (key.includes("-") || key === "role" || key === "for" || key === "list") element.setAttribute(key, value);
    else element[key] = value;
  }
  element.append(...children.filter((child) => child != null && child !== false).map(nodeOf));
  return element;
}

/**
 * An element of a drawing. Its look comes from the style sheet; lengths may be percentages.
 * @param {string} tag with classes: "rect.bulk" @param {Object<string, string|number>} [attributes]
 * @param {...(Node|string)} children
 * @returns {SVGElement}
 */
export function svg(tag, attributes = {}, ...children) {
  const [name, ...classes] = tag.split(".");
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  if (classes.length) element.setAttribute("class", classes.join(" "));
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, String(value));
  element.append(...children);
  return element;
}

const nodeOf = (child) => (child instanceof Node ? child : String(child));

/** Sets the text only when it differs, so that live regions and selections keep still. */
export function say(element, text) {
  if (element.textContent !== String(text)) element.textContent = text;
}

/** Makes `parent` hold exactly `children`, moving only what is out of place. @param {Element[]} children */
export function arrange(parent, children) {
  const keep = new Set(children);
  for (const child of [...parent.children]) if (!keep.has(child)) child.remove();
  children.forEach((child, at) => {
    if (parent.children[at] !== child) parent.insertBefore(child, parent.children[at] ?? null);
  });
}

/** A click as it is meant for this page; those that ask for another tab or window stay the browser's. @param {() => void} act */
export const onPlainClick = (act) => (event) => {
  if (event.metaKey || event.ctrlKey || event.shiftKey || event.button) return;
  event.preventDefault();
  act();
};

/**
 * Calls `leave` when a reader wants an open dialog gone: Esc, or the back gesture of a phone. Browsers close several
 * dialogs at once, or without asking, where nobody has clicked yet; so the key is taken before they see it, and what
 * they closed is left too.
 * @param {HTMLDialogElement} dialog @param {() => void} leave closes it; does nothing when it is left already
 */
export function onDismiss(dialog, leave) {
  dialog.addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    event.preventDefault();
    leave();
  });
  dialog.addEventListener("cancel", (event) => {
    event.preventDefault();
    leave();
  });
  dialog.addEventListener("close", () => dialog.open || leave());
}
