// The page keeps no table of what worlds tell: no name of a world, a term or a measure stands in its modules.
import assert from "node:assert/strict";
import { readdir, readFile } from "node:fs/promises";
import { after, before, test } from "node:test";
import { api, json, startProgram } from "./fixture.mjs";

/** Names that are words of the page's own too: an order of samples, an axis, a contact, a side. Quoted, as keys of a
 * table would be, they must not stand there either. */
const OWN_WORDS = new Map([["order", "url and gallery.js: the order of samples"], ["x", "an axis"], ["contacts", "arrows of the large view"], ["total", "how many there are"], ["inside", "within"], ["face", "a side of a mesh"], ["miss", "of what an address names and is not there"]]);
const APP = new URL("../../web/app/", import.meta.url);

let program;
const names = new Set();
const modules = new Map();

before(async () => {
  program = await startProgram({ world: null, examples: false });
  const { worlds } = await api(program, "/v1/worlds");
  for (const world of worlds) {
    names.add(world.name);
    for (const { kind } of world.constraints) names.add(kind);
    for (const { name } of world.measures) names.add(name);
    // One example of each set of terms, which add their measures.
    const kindsOf = ({ constraints }) => String([...new Set(constraints.map(({ kind }) => kind))].sort());
    for (const example of new Map(world.examples.map((each) => [kindsOf(each), each])).values()) {
      const { measures } = await api(program, "/v1/scenarios", json(example));
      for (const { name } of measures) names.add(name);
    }
  }
  for (const file of await readdir(APP)) {
    if (file.endsWith(".js")) modules.set(file, withoutComments(await readFile(new URL(file, APP), "utf8")));
  }
});

after(async () => {
  await program.end();
  await program.remove();
});

const withoutComments = (text) => text.replace(/\/\*[^]*?\*\//g, "").replace(/(^|\s)\/\/.*$/gm, "");

/** Where a name stands in the page's code as a word; of its own words only in quotes or before a colon of a table. */
function placesOf(name) {
  const word = OWN_WORDS.has(name) ? new RegExp(`["'\`]${name}["'\`]\\s*[:\\])]`) : new RegExp(`(?<![\\w-])${name}(?![\\w-])`);
  return [...modules].flatMap(([file, text]) => text.split("\n").filter((line) => word.test(line)).map((line) => `${file}: ${line.trim()}`));
}

test("names of worlds, terms and measures are known", () => {
  for (const name of ["bowling", "rest_position", "entry_speed", "filled_bins", "miss"]) assert.ok(names.has(name), name);
  assert.ok(modules.has("words.js") && modules.size > 20);
});

test("no module of the page has one of them", () => {
  assert.deepEqual([...names].flatMap(placesOf), []);
});
