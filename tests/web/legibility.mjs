// What makes a text legible, measured in the page: no text lies on another one or under something, none is cut off or
// sticks out of its box, no word is broken apart, and nothing has to be looked for beyond the edge of the window.

/**
 * Every fault of the texts that are seen now, in words. Runs in the page, so it knows nothing of this module.
 * @returns {string[]}
 */
export function faultsOfText() {
  /** What may be scrolled sideways: the table of chains and documents, which are wider than a phone; the scenarios on a phone, a strip. */
  const SIDEWAYS = ".scroller, pre, textarea, #scenario-list";
  const SLACK = 1; // [px] of rounding
  const AIR = 0.22; // of a line's box above and below its letters
  const LEAST_SEEN = 8; // characters of a text that ends in an ellipsis
  const LEAST_FRAGMENT = 3; // characters that a broken word leaves on a line
  const LEAST_LINE = 8; // characters on a line, of four lines or more
  const ARROW = 20; // [px] of a select

  const faults = new Set();
  const edge = document.documentElement.clientWidth;
  // Behind a dialog nothing can be reached, and it is meant to be dim.
  const scope = [...document.querySelectorAll("dialog:modal")].at(-1) ?? document.body;
  const styles = new Map();
  const styleOf = (element) => styles.get(element) ?? styles.set(element, getComputedStyle(element)).get(element);
  const brief = (text) => `“${text.trim().replace(/\s+/g, " ").slice(0, 40)}”`;
  const nameOf = (element) => `${element.localName}${element.id ? `#${element.id}` : ""}${[...element.classList].map((name) => `.${name}`).join("")}`;
  const alphaOf = (color) => (color.startsWith("rgb(") ? 1 : Number(color.match(/[,/]\s*([\d.]+)\)$/)?.[1] ?? 1));
  const isPainted = (element) => {
    const style = styleOf(element);
    return alphaOf(style.backgroundColor) > 0.4 || style.backgroundImage !== "none";
  };
  const intersection = (a, b) => ({ left: Math.max(a.left, b.left), right: Math.min(a.right, b.right), top: Math.max(a.top, b.top), bottom: Math.min(a.bottom, b.bottom) });
  const isEmpty = ({ left, right, top, bottom }) => right - left < SLACK || bottom - top < SLACK;
  const letters = ({ left, right, top, bottom }) => ({ left: left + SLACK, right: right - SLACK, top: top + AIR * (bottom - top), bottom: bottom - AIR * (bottom - top) });
  const visible = (element) => element.checkVisibility({ visibilityProperty: true, opacityProperty: true });
  // Told to screen readers only.
  const isForEars = (element) => {
    for (let each = element; each; each = each.parentElement) if (styleOf(each).clipPath === "inset(50%)") return true;
    return false;
  };

  /** The ancestors that may clip an element, the nearest first. */
  function* clippers(element) {
    let { position } = styleOf(element);
    for (let each = element.parentElement, self = element; each && each !== document.body; self = each, each = each.parentElement) {
      if (position === "fixed") return;
      const style = styleOf(each);
      if (position === "absolute" && style.position === "static") continue;
      position = style.position;
      yield each;
    }
  }

  /** What of a line is seen by itself or after scrolling downwards; null if nothing. Says where it is cut off. */
  function seen(line, node) {
    let rest = line;
    const element = node.parentElement;
    for (const each of [element, ...clippers(element)]) {
      const { overflowX, overflowY, textOverflow, display } = styleOf(each);
      if (display === "inline" || (overflowX === "visible" && overflowY === "visible")) continue;
      const box = each.getBoundingClientRect();
      const inner = { left: box.left + each.clientLeft, top: box.top + each.clientTop, right: box.left + each.clientLeft + each.clientWidth, bottom: box.top + each.clientTop + each.clientHeight };
      const scrolls = (overflow) => overflow === "auto" || overflow === "scroll";
      const outX = rest.left < inner.left - SLACK || rest.right > inner.right + SLACK;
      const needed = letters(rest);
      const outY = needed.top < inner.top - SLACK || needed.bottom > inner.bottom + SLACK;
      if (outX && !scrolls(overflowX)) {
        const part = Math.max(0, Math.min(rest.right, inner.right) - Math.max(rest.left, inner.left)) / (rest.right - rest.left);
        const told = node.data.trim().length;
        if (textOverflow !== "ellipsis") faults.add(`${brief(node.data)} is cut off at the side by ${nameOf(each)}`);
        else if (part * told < Math.min(LEAST_SEEN, told)) faults.add(`${brief(node.data)} is cut to ${Math.floor(part * told)} characters by ${nameOf(each)}`);
      }
      if (outY && !scrolls(overflowY)) faults.add(`${brief(node.data)} is cut off above or below by ${nameOf(each)}`);
      rest = intersection(rest, inner);
      if (isEmpty(rest)) return null;
    }
    return rest;
  }

  // Every line of every text.
  const lines = [];
  const range = document.createRange();
  const walker = document.createTreeWalker(scope, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const node = walker.currentNode;
    const element = node.parentElement;
    if (!node.data.trim() || element.closest("option, textarea, script, noscript, title") || !visible(element) || isForEars(element)) continue;
    range.selectNodeContents(node);
    const boxes = [...range.getClientRects()].filter((box) => !isEmpty(box));
    measureWords(node, boxes);
    for (const box of boxes) {
      const rest = seen(box, node);
      if (!rest) continue;
      if (rest.left < -SLACK || rest.right > edge + SLACK) faults.add(`${brief(node.data)} sticks out of the window`);
      stickOut(rest, node);
      lines.push({ node, element, box: rest, core: letters(rest) });
    }
  }

  /** Words that are broken apart, and lines of a word each. */
  function measureWords(node, boxes) {
    const rows = new Set(boxes.map(({ top }) => Math.round(top))).size;
    if (rows < 2 || styleOf(node.parentElement).whiteSpace.startsWith("pre")) return;
    const told = node.data.trim().length;
    if (rows >= 4 && told / rows < LEAST_LINE) faults.add(`${brief(node.data)} stands on ${rows} lines of ${(told / rows).toFixed(1)} characters`);
    for (const { 0: word, index } of node.data.matchAll(/[\p{L}\p{N}]{4,}/gu)) {
      range.setStart(node, index);
      range.setEnd(node, index + word.length);
      const parts = [...range.getClientRects()].filter((box) => !isEmpty(box));
      if (new Set(parts.map(({ top }) => Math.round(top))).size < 2) continue;
      const whole = parts.reduce((sum, { width }) => sum + width, 0);
      const least = Math.min(...parts.map(({ width }) => (word.length * width) / whole));
      if (least < LEAST_FRAGMENT || parts.length > 2) faults.add(`the word ${brief(word)} is broken apart`);
    }
  }

  /** Out of the nearest box around it that has an edge or a ground of its own. */
  function stickOut(line, { data, parentElement }) {
    for (let each = parentElement; each && each !== scope; each = each.parentElement) {
      const style = styleOf(each);
      if (style.display === "inline" || each instanceof SVGElement) continue;
      const edged = ["Top", "Right", "Bottom", "Left"].every((side) => parseFloat(style[`border${side}Width`]) > 0 && alphaOf(style[`border${side}Color`]) > 0);
      if (edged || isPainted(each)) {
        const box = each.getBoundingClientRect();
        const core = letters(line);
        if (line.left < box.left - SLACK || line.right > box.right + SLACK || core.top < box.top - SLACK || core.bottom > box.bottom + SLACK) faults.add(`${brief(data)} sticks out of ${nameOf(each)}`);
        return;
      }
      if (style.position === "absolute" || style.position === "fixed") return;
    }
  }

  // Texts on texts. Notices float over the page for six seconds, on purpose.
  const floats = (element) => element.closest(".notices") !== null;
  lines.sort((a, b) => a.core.top - b.core.top);
  lines.forEach((one, at) => {
    for (let next = at + 1; next < lines.length && lines[next].core.top < one.core.bottom; ++next) {
      const other = lines[next];
      if (one.node === other.node || floats(one.element) !== floats(other.element)) continue;
      const both = intersection(one.core, other.core);
      if (!isEmpty(both)) faults.add(`${brief(one.node.data)} and ${brief(other.node.data)} overlap by ${Math.round(both.right - both.left)} x ${Math.round(both.bottom - both.top)} px`);
    }
  });

  // Things on texts. What lets clicks through hides a text all the same.
  const solid = new CSSStyleSheet();
  solid.replaceSync("* { pointer-events: auto !important; }");
  document.adoptedStyleSheets.push(solid);
  for (const { node, element, box } of lines) {
    for (const share of [0.05, 0.5, 0.95]) {
      const [x, y] = [box.left + share * (box.right - box.left), (box.top + box.bottom) / 2];
      const stack = document.elementsFromPoint(x, y);
      const above = stack.slice(0, stack.findIndex((each) => each === element || each.contains(element)));
      const cover = above.find((each) => !element.contains(each) && !floats(each) && (isPainted(each) || each.matches("img, canvas, video, circle, rect, path, line")));
      if (cover && stack.length) faults.add(`${brief(node.data)} is covered by ${nameOf(cover)}`);
    }
  }
  document.adoptedStyleSheets.pop();

  // What fields hold; they have no text of their own in the document.
  const pen = new OffscreenCanvas(1, 1).getContext("2d");
  for (const field of scope.querySelectorAll("select, input[type=text], input[type=number]")) {
    if (!visible(field)) continue;
    const style = styleOf(field);
    const text = field.localName === "select" ? field.selectedOptions[0]?.textContent ?? "" : field.value || field.placeholder;
    pen.font = style.font;
    const room = field.clientWidth - parseFloat(style.paddingLeft) - parseFloat(style.paddingRight) - (field.localName === "select" ? ARROW : 0);
    if (pen.measureText(text).width > room + SLACK && style.textOverflow !== "ellipsis") faults.add(`${brief(text)} has too little room in ${nameOf(field)}`);
  }

  // Beyond the edges of the window and of what does not scroll sideways on purpose.
  for (const element of [document.documentElement, scope, ...scope.querySelectorAll("*")]) {
    if (element instanceof SVGElement || element.clientWidth === 0 || element.scrollWidth <= element.clientWidth + SLACK || element.matches(SIDEWAYS)) continue;
    const { overflowX } = styleOf(element);
    if (element === document.documentElement || overflowX === "auto" || overflowX === "scroll") faults.add(`${nameOf(element)} is wider inside (${element.scrollWidth} px) than it is (${element.clientWidth} px)`);
  }
  if (scope.localName === "dialog") {
    const { left, right, top, bottom } = scope.getBoundingClientRect();
    if (left < 0 || right > innerWidth || top < 0 || bottom > innerHeight) faults.add(`${nameOf(scope)} sticks out of the window`);
  }
  return [...faults];
}
