#!/usr/bin/env python3
"""Fails on a reference to a document, a section, a file or a place that does not exist, and on counts that are wrong.

Usage: documents.py SOURCE_FOLDER [PROGRAM]. Looks at every file that git knows. With the program, the numbers of
worlds, examples and methods that the pages tell are held to what it says.
"""
import json
import pathlib
import re
import subprocess
import sys

root = pathlib.Path(sys.argv[1]).resolve()
program = sys.argv[2] if len(sys.argv) > 2 else None

CODE = {".h", ".cpp", ".js", ".mjs", ".py", ".R", ".css"}
EXTENSIONS = r"(?:h|cpp|js|mjs|css|html|py|R|md|txt|json|png|svg|lua|supp)"
NUMBERS = ("zero one two three four five six seven eight nine ten eleven twelve thirteen fourteen fifteen sixteen "
           "seventeen eighteen nineteen").split()
NUMBERS += [tens + ones for tens in ("twenty", "thirty", "forty")
            for ones in ("", *(f"-{one}" for one in NUMBERS[1:10]))]


def listed(folder):
    """Files of the tree: those that git knows, or would if they were added; without git, all but what is built."""
    try:
        names = subprocess.run(["git", "-C", folder, "ls-files", "-co", "--exclude-standard"], check=True,
                               capture_output=True, text=True).stdout.split("\n")
    except (OSError, subprocess.CalledProcessError):
        names = (str(path.relative_to(folder)) for path in folder.rglob("*"))
    skipped = {"build", "node_modules", ".git"}
    return {name for name in names if name and not skipped & set(name.split("/")) and (folder / name).is_file()}


files = listed(root)
folders = {"/".join(name.split("/")[:depth]) for name in files for depth in range(1, name.count("/") + 1)}
names = {name.split("/")[-1] for name in files}
texts = {name: (root / name).read_text() for name in sorted(files)
         if pathlib.PurePath(name).suffix in CODE | {".md", ".txt"} or name.startswith("scripts/")}
libraries = {header for text in texts.values() for header in re.findall(r"^ *#include <([\w.]+)>", text, re.M)}
libraries |= {f"{package}.js" for package in json.loads((root / "web/package.json").read_text())["dependencies"]}
pages = {name: text for name, text in texts.items() if name.endswith(".md")}
faults = []


def fault(name, place, what):
    line = texts[name].count("\n", 0, place) + 1
    faults.append(f"{name}:{line}: {what}")


def without_blocks(page):
    """A page without its fenced blocks, every other character where it was."""
    return re.sub(r"^```.*?^```", lambda block: re.sub(r"[^\n]", " ", block[0]), page, flags=re.M | re.S)


def headings(page):
    return [(match[1], match.start()) for match in re.finditer(r"^#+ +(.+?) *$", without_blocks(page), re.M)]


def anchors(page):
    """The anchors of a page's headings, as GitHub makes them."""
    made = {}
    for heading, _ in headings(page):
        words = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading).lower()
        anchor = re.sub(r"[^\w\- ]", "", words).replace(" ", "-")
        made[anchor] = made.get(anchor, -1) + 1
        yield f"{anchor}-{made[anchor]}" if made[anchor] else anchor


def resolves(mention, folder):
    """Whether a path, or a name, or a pattern of either, is that of a file: from the root, a folder or anywhere."""
    if mention in libraries:
        return True
    for each in ([f"{stem}.{end}" for stem, ends in [re.match(r"(.*)\.\{(.*)\}$", mention).groups()]
                  for end in ends.split(",")] if "{" in mention else [mention]):
        pattern = re.compile(re.escape(each).replace(r"\*", "[^/]*"))
        beside = re.compile(re.escape(str(folder) + "/" if str(folder) != "." else "") + pattern.pattern)
        where = (files, files) if "/" in each else (files | names, files)
        if not any(pattern.fullmatch(name) for name in where[0]) and not any(beside.fullmatch(name) for name in where[1]):
            return False
    return True


# --- Sections of the documents ------------------------------------------------------------------

sections = {}  # document -> section's number -> the names of its parts
for name, page in pages.items():
    numbered, current = {}, None
    for heading, place in headings(page):
        match = re.match(r"(\d+)\. (.+)", heading)
        if match:
            current = int(match[1])
            if current in numbered:
                fault(name, place, f"section {current} is there twice")
            numbered[current] = {match[2].lower()}
        elif current:
            numbered[current].add(heading.lower())
    sections[name] = (numbered, {heading.lower() for heading, _ in headings(page)})

REFERENCE = re.compile(
    r"(?P<document>\b[\w./-]+\.md)(?:, sections? (?P<numbers>\d+(?:(?:, | and )\d+)*))?(?:, \"(?P<part>[^\"]+)\")?")
for name, text in texts.items():
    if name == "tests/checks/documents.py":
        continue
    # A reference may go over a line's end.
    flowing = re.sub(r"\n(?: *(?://+|#|\*) ?)?", lambda end: " " + "\0" * (len(end[0]) - 1), text)
    plain = flowing.replace("\0", "")
    place_of = [place for place, letter in enumerate(flowing) if letter != "\0"]
    for match in re.finditer(r"\b(?:DESIGN|STYLE|REALITY)\b|\b(?:API|HTTP)\.md\b", plain):
        fault(name, place_of[match.start()], f"{match[0]} is no document here: write doc/design.md, section 3")
    for match in REFERENCE.finditer(plain):
        place, document = place_of[match.start()], match["document"]
        folder = pathlib.PurePath(name).parent
        beside = (folder / document).as_posix()
        target = beside if beside in pages else document
        if not match["numbers"] and not match["part"]:
            continue  # a path like any other
        if target not in pages:
            fault(name, place, f"there is no document {document}")
            continue
        numbered, all_headings = sections[target]
        wanted = [int(number) for number in re.findall(r"\d+", match["numbers"] or "")]
        for number in wanted:
            if number not in numbered:
                fault(name, place, f"{document} has no section {number}")
        where = set().union(*(numbered.get(number, set()) for number in wanted)) if wanted else all_headings
        if match["part"] and match["part"].lower() not in where:
            fault(name, place, f"{document} has no part \"{match['part']}\""
                  + (f" in section {match['numbers']}" if wanted else ""))

# --- Links and paths ----------------------------------------------------------------------------

for name, page in pages.items():
    folder = pathlib.PurePath(name).parent
    prose = without_blocks(page)
    for match in re.finditer(r"\]\((?!\w+:)([^)#\s]*)(?:#([^)\s]*))?\)", prose):
        parts = []
        for part in (folder / match[1]).parts:
            parts = parts[:-1] if part == ".." else parts + [part]
        target = "/".join(parts) if match[1] else name
        if target not in files and target not in folders:
            fault(name, match.start(), f"there is no {target}")
        elif match[2] and match[2] not in set(anchors(pages.get(target, ""))):
            fault(name, match.start(), f"{target} has no place #{match[2]}")
    for match in re.finditer(r"`([^`\s]+)`", prose):
        mention = match[1].rstrip("/")
        is_file = re.fullmatch(rf"[\w./*{{}},-]*\w\.(?:{EXTENSIONS}|\{{[\w,]+\}})", mention)
        is_folder = match[1].endswith("/") and not match[1].startswith("/") and re.fullmatch(r"[\w./-]+/", match[1])
        if is_file and not mention.startswith("/") and not resolves(mention, folder):
            fault(name, match.start(), f"there is no file {mention}")
        if is_folder and mention not in folders and (folder / mention).as_posix() not in folders \
                and mention.split("/")[0] != "build" and not match[1].startswith("…"):
            fault(name, match.start(), f"there is no folder {match[1]}")
for name, text in texts.items():
    if pathlib.PurePath(name).suffix not in CODE:
        continue
    comment = r"^\s*(?:///?|\*|/\*\*?|#(?!include))(.*)$" if not name.endswith(".py") else r"^\s*#(.*)$"
    for line in re.finditer(comment, text, re.M):
        for match in re.finditer(rf"(?<![\w./*{{<-])[\w/*]*\w\.(?:h|cpp|js|mjs|py|md)\b(?![\w(])", line[1]):
            if not resolves(match[0], pathlib.PurePath(name).parent):
                fault(name, line.start(1) + match.start(), f"there is no file {match[0]}")

# --- Problems -----------------------------------------------------------------------------------

contract = pages["doc/api.md"]
documented = set(re.findall(r"^\| `([a-z-]+)` \| (\d{3}) \|", contract, re.M))
raised = set()
for name, text in texts.items():
    if name.startswith("server/"):
        raised |= {(kind, status) for status, kind in re.findall(r"HttpProblem[^;\"]*?\( ?(\d{3}), *\"([a-z-]+)\"",
                                                               re.sub(r"\s+", " ", text))}
for kind, status in sorted(raised - documented):
    faults.append(f"doc/api.md: the problem {kind} ({status}) is raised, but not documented")
for kind, status in sorted(documented - raised):
    faults.append(f"doc/api.md: the problem {kind} ({status}) is documented, but nowhere raised")

# --- Routes that are mentioned ------------------------------------------------------------------

routes = {}  # path without the names of its parts -> methods
for method, path in re.findall(r"^### (GET|POST|PUT|PATCH|DELETE) (/\S*)$", contract, re.M):
    routes.setdefault(re.sub(r"\{\w+\}", "{}", path), set()).add(method)
for name, page in pages.items():
    for match in re.finditer(r"`(?:([A-Z]+) )?((?:/v1)?/[\w/{}-]*)(?:\?[^`]*)?`", without_blocks(page)):
        method, path = match[1], re.sub(r"\{\w+\}", "{}", match[2])
        if (method and path not in routes) or (not method and path.startswith("/v1/") and path not in routes):
            fault(name, match.start(), f"there is no route {match[2]}")
        elif method and method not in routes[path]:
            fault(name, match.start(), f"{match[2]} does not know {method}")

# --- Counts -------------------------------------------------------------------------------------

if program:
    worlds = json.loads(subprocess.run([program, "worlds", "--json"], check=True, capture_output=True).stdout)["worlds"]
    counts = {"worlds": len(worlds), "example scenarios": sum(len(world["examples"]) for world in worlds),
              "methods": len(worlds[0]["methods"])}
    told = set()
    for name in ("README.md", *(page for page in pages if page.startswith("doc/"))):
        prose = pages[name]
        for match in re.finditer(rf"\b({'|'.join(sorted(NUMBERS, key=len, reverse=True))}|\d+) ({'|'.join(counts)})\b",
                                 prose, re.I):
            told.add(match[2].lower())
            number = int(match[1]) if match[1].isdigit() else NUMBERS.index(match[1].lower())
            if number != counts[match[2].lower()]:
                fault(name, match.start(), f"there are {counts[match[2].lower()]} {match[2]}, not {match[1]}")
    for each in sorted(set(counts) - told):
        faults.append(f"README.md: nobody tells how many {each} there are, so nothing was checked")

print("\n".join(faults) or "every reference leads somewhere")
sys.exit(1 if faults else 0)
