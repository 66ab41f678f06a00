// Finds what a JSON Pointer means in the text of a document, so that a fault can be shown where it is.

/**
 * @param {string} text @param {string} pointer RFC 6901
 * @returns {[number, number]|null} first and last offset of the value, or of the nearest one around it
 */
export function placeOf(text, pointer) {
  const path = pointer.split("/").slice(1).map((part) => part.replaceAll("~1", "/").replaceAll("~0", "~"));
  let best = null;
  let at = 0;
  const blank = () => {
    while (/\s/.test(text[at] ?? "")) ++at;
  };
  const string = () => {
    const start = at++;
    while (at < text.length && text[at] !== '"') at += text[at] === "\\" ? 2 : 1;
    return JSON.parse(text.slice(start, ++at));
  };
  /** @param {string[]|null} rest what is left of the path here; null beside it */
  const value = (rest) => {
    blank();
    const start = at;
    if (text[at] === "{" || text[at] === "[") {
      const close = text[at] === "{" ? "}" : "]";
      ++at;
      blank();
      for (let index = 0; at < text.length && text[at] !== close; ++index) {
        let key = String(index);
        if (close === "}") {
          key = string();
          blank();
          ++at;
        }
        value(rest?.length && rest[0] === key ? rest.slice(1) : null);
        blank();
        if (text[at] === ",") ++at;
        blank();
      }
      ++at;
    } else if (text[at] === '"') {
      string();
    } else {
      while (at < text.length && !/[\s,\]}]/.test(text[at])) ++at;
      if (at === start) ++at;
    }
    // Inner values come first, so the first match is the deepest.
    if (rest) best ??= [start, Math.min(at, text.length)];
  };
  try {
    value(path);
  } catch {
    return null;
  }
  return best;
}
