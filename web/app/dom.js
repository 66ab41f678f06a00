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
