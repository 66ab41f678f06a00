// The page's few icons, drawn on a 24 unit square.
import { svg } from "./dom.js";

const PATHS = {
  play: "M8 5.500v13l11-6.500z",
  pause: "M8 5v14M16 5v14",
  stop: "M7 7h10v10H7z",
  repeat: "M4 12a8 8 0 0 1 13.700-5.700L20 8.500M20 4v4.500h-4.500M20 12a8 8 0 0 1-13.700 5.700L4 15.500M4 20v-4.500h4.500",
  sun: "M12 8a4 4 0 1 0 0 8a4 4 0 1 0 0-8M12 2.500v2M12 19.500v2M2.500 12h2M19.500 12h2M5.300 5.300l1.400 1.400M17.300 17.300l1.400 1.400M5.300 18.700l1.400-1.400M17.300 6.700l1.400-1.400",
  moon: "M20 14.500A8.500 8.500 0 0 1 9.500 4a8.500 8.500 0 1 0 10.500 10.500z",
  plus: "M12 5v14M5 12h14",
  close: "M6 6l12 12M18 6L6 18",
  next: "M9 5l7 7-7 7",
  previous: "M15 5l-7 7 7 7",
  path: "M3 19C4 9 6 5 8 5s4 7 5 14c1-8 2.500-11 4-11s3 5 4 11",
  together: "M4 5h7v6H4zM13.500 5h6.500v6h-6.500zM4 13.500h7v6H4zM13.500 13.500h6.500v6h-6.500z",
  frame: "M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5",
  sprout: "M12 21v-9M12 14C12 9.500 9 6.500 3.500 6.500C3.500 11.500 7 14 12 14M12 11C12 6.500 15 3.500 20.500 3.500C20.500 8.500 17 11 12 11",
  check: "M5 12.500l4.500 4.500L19 7.500",
};

/** @param {keyof typeof PATHS} name */
export function icon(name) {
  const kind = name === "play" || name === "stop" ? "svg.icon.solid" : "svg.icon";
  return svg(kind, { viewBox: "0 0 24 24", "aria-hidden": "true" }, svg("path", { d: PATHS[name] }));
}
