#!/usr/bin/env python3
"""Fails on an #include that goes against the arrows between the folders, and on a library seen by too many files."""
import pathlib
import re
import sys

root = pathlib.Path(sys.argv[1])

# Folder -> folders of the project that its files may include.
ALLOWED = {
    "sampler": {"sampler"},
    "worlds": {"worlds", "sampler"},
    "db": {"db", "sampler"},
    "server": {"server", "worlds", "db", "sampler", "web"},  # of web/ the embedded files alone
}
# Library header -> folders that may see it, and how many files at most.
LIBRARIES = {
    r"httplib\.h": ({"server"}, 2),
    r"sqlite3\.h": ({"db"}, 2),
    r"nlohmann/.*": ({"worlds", "server"}, None),
    r"bt.*|.*[bB]ullet.*": ({"worlds"}, 4),
}
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.M)

faults, seen = [], {library: [] for library in LIBRARIES}
for folder, allowed in ALLOWED.items():
    for path in sorted((root / folder).rglob("*")):
        if path.suffix not in {".h", ".cpp"}:
            continue
        name = path.relative_to(root)
        for include in INCLUDE.findall(path.read_text()):
            top = include.split("/")[0]
            if top in {*ALLOWED, "web", "tests", "bench"} and top not in allowed:
                faults.append(f"{name}: {folder}/ may not include {include}")
            if "/" not in include and (path.parent / include).exists():
                faults.append(f"{name}: write {include} from the root")
            for library, (folders, _) in LIBRARIES.items():
                if re.fullmatch(library, include):
                    seen[library].append(str(name))
                    if folder not in folders:
                        faults.append(f"{name}: {folder}/ may not see {include}")
for library, (_, most) in LIBRARIES.items():
    if most is not None and len(seen[library]) > most:
        faults.append(f"{library} is included by {len(seen[library])} files, at most {most}: {seen[library]}")

print("\n".join(faults) or "every include follows the arrows")
sys.exit(1 if faults else 0)
