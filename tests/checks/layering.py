#!/usr/bin/env python3
"""Fails on an #include that goes against the arrows between the rooms, on two files that include each other, on
what a room must not know, and on a library that is seen by too many files."""
import pathlib
import re
import sys

root = pathlib.Path(sys.argv[1])

# Room -> what its files may include of the project. The longest room that begins a file's path is its room.
SAMPLER = {"sampler"}
WORLDS = SAMPLER | {"worlds"}  # the words on which every world and every term stands
ENGINES = {"worlds/impulse", "worlds/rigid"}
DB = {"db", "sampler"}
HTTP = {"server/http", "worlds/document.h", "sampler/check.h"}
CHAINS = {"server/chains", "db", "worlds", "worlds/formats", "sampler"}
API = CHAINS | HTTP | {"server/api"}
ROOMS = {
    "sampler": SAMPLER,
    "worlds": WORLDS,
    "worlds/registry.cpp": WORLDS | {"worlds/ball2d", "worlds/bowling", "worlds/dice", "worlds/spelling"},
    "worlds/terms": WORLDS | {"worlds/terms"},
    "worlds/formats": WORLDS | {"worlds/formats"},
    "worlds/impulse": WORLDS | {"worlds/impulse"},
    "worlds/rigid": WORLDS | {"worlds/rigid"},
    "worlds/ball2d": WORLDS | ENGINES | {"worlds/terms", "worlds/ball2d"},
    "worlds/bowling": WORLDS | ENGINES | {"worlds/terms", "worlds/bowling"},
    "worlds/dice": WORLDS | ENGINES | {"worlds/terms", "worlds/dice"},
    "worlds/spelling": WORLDS | ENGINES | {"worlds/terms", "worlds/spelling"},
    "db": DB,
    "db/open_store.cpp": DB | {"db/sqlite"},
    "db/sqlite": DB | {"db/sqlite"},
    "server/http": HTTP,
    "server/chains": CHAINS,
    "server/api": API | {"web"},
    "server/commands": API | {"server/commands"},
    "server/main.cpp": {"server/commands"},
}
# Library header -> rooms (with all below them) that may see it, and how many files at most.
LIBRARIES = {
    r"httplib\.h": (("server/http",), 2),
    r"sqlite3\.h": (("db/sqlite",), 1),
    r"nlohmann/.*": (("worlds", "server"), None),
    r"CLI/.*": (("server/commands",), 1),
    r"bt.*|.*[bB]ullet.*": (("worlds/rigid", "worlds/bowling"), 4),
    r"zstd\.h": (("worlds",), 1),
    r"xxhash\.h": (("worlds", "db/sqlite"), 3),
    r"z(lib|conf)\.h|brotli/.*|openssl/.*": (("server",), 3),
}
# Files -> headers that "It must not know" at their heads rules out.
UNKNOWN_TO = {
    r"sampler/.*": r"chrono|thread|mutex|filesystem|fstream|random",
    r"worlds/.*": r"thread|chrono|filesystem|fstream|random",
    r"worlds/animation\..*|worlds/measure\..*|worlds/formats/recorded\..*": r"nlohmann/.*|worlds/world\.h",
    r"worlds/world\.h|worlds/scenario\.h|worlds/term\.h": r"sampler/(chain|walk|methods|diagnostics)\.h",
    r"worlds/terms/.*": r"worlds/world\.h|worlds/scenario\.h",
    r"server/api/views\..*": r"server/http/.*|db/store\.h",
    r"server/chains/(trace|quantities|health|measures|chain_run|gathered_draws)\..*": r"db/store\.h|thread|mutex",
}
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.M)

files = {
    str(path.relative_to(root)): INCLUDE.findall(path.read_text())
    for top in ("sampler", "worlds", "db", "server")
    for path in sorted((root / top).rglob("*"))
    if path.suffix in {".h", ".cpp"}
}
TOPS = {"sampler", "worlds", "db", "server", "web", "tests", "bench"}


def room_of(name):
    """The rooms are the keys of ROOMS; a file in none of them is a fault."""
    fits = [room for room in ROOMS if name == room or name.startswith(room + "/")]
    return max(fits, key=len, default=None)


def folder_of(include):
    return include.rsplit("/", 1)[0]


faults, seen = [], {library: [] for library in LIBRARIES}
for name, includes in files.items():
    room = room_of(name)
    own_folder = folder_of(name)
    if room is None or (own_folder != room and name != room):
        faults.append(f"{name}: {own_folder}/ is no room that tests/checks/layering.py knows")
        continue
    for include in includes:
        if include.split("/")[0] in TOPS and not {include, folder_of(include)} & ROOMS[room]:
            faults.append(f"{name}: {room} may not include {include}")
        if "/" not in include and (root / own_folder / include).exists():
            faults.append(f"{name}: write {include} from the root")
        for library, (rooms, _) in LIBRARIES.items():
            if re.fullmatch(library, include):
                seen[library].append(name)
                if not any(name.startswith(each + "/") for each in rooms):
                    faults.append(f"{name}: {room} may not see {include}")
        for those, unknown in UNKNOWN_TO.items():
            if re.fullmatch(those, name) and re.fullmatch(unknown, include):
                faults.append(f"{name}: it must not know {include}")
for library, (_, most) in LIBRARIES.items():
    if most is not None and len(set(seen[library])) > most:
        faults.append(f"{library} is included by {len(set(seen[library]))} files, at most {most}: {sorted(set(seen[library]))}")

# No two parts (a header and its source) include each other, over whatever ways.
parts = {}
for name, includes in files.items():
    part = name.rsplit(".", 1)[0]
    parts.setdefault(part, set()).update(i.rsplit(".", 1)[0] for i in includes if i in files)
state = {}


def walk(part, path):
    state[part] = "open"
    for other in sorted(parts.get(part, ())):
        if other == part:
            continue
        if state.get(other) == "open":
            circle = path[path.index(other):] + [other] if other in path else [part, other]
            faults.append("a circle of includes: " + " -> ".join(circle))
        elif other not in state:
            walk(other, path + [other])
    state[part] = "closed"


for part in sorted(parts):
    if part not in state:
        walk(part, [part])

print("\n".join(faults) or "every include follows the arrows")
sys.exit(1 if faults else 0)
