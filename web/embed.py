#!/usr/bin/env python3
"""Writes the page's files as an assembler file of bytes and a C++ table of what they are.

usage: embed.py list WEB               prints every file of the page, one a line (for CMake's dependencies)
       embed.py write WEB OUT_FOLDER   writes OUT_FOLDER/page_bytes.S, page_table.cpp and the compressed files
"""
import gzip
import hashlib
import pathlib
import sys

# Served path -> file below web/. What stands in app/ is added to it.
FILES = {
    "/": "index.html",
    "/favicon.svg": "favicon.svg",
    "/vendor/inter.woff2": "node_modules/@fontsource-variable/inter/files/inter-latin-wght-normal.woff2",
    "/vendor/inter.license.txt": "node_modules/@fontsource-variable/inter/LICENSE",
    "/vendor/three.core.js": "node_modules/three/build/three.core.js",
    "/vendor/three.module.js": "node_modules/three/build/three.module.js",
    "/vendor/uplot.css": "node_modules/uplot/dist/uPlot.min.css",
    "/vendor/uplot.js": "node_modules/uplot/dist/uPlot.esm.js",
}
TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".woff2": "font/woff2",
    ".txt": "text/plain; charset=utf-8",
    "": "text/plain; charset=utf-8",
}


def page_files(web):
    files = {path: web / name for path, name in FILES.items()}
    for file in (web / "app").iterdir():
        if file.suffix in {".js", ".css"}:
            files[f"/app/{file.name}"] = file
    return sorted(files.items())


def write(web, out):
    out.mkdir(parents=True, exist_ok=True)
    assembler = ['.section .rodata, "a"\n']
    declarations, rows = [], []
    for number, (path, file) in enumerate(page_files(web)):
        content = file.read_bytes()
        packed = out / f"page_{number}.gz"
        packed.write_bytes(gzip.compress(content, compresslevel=9, mtime=0))
        etag = hashlib.sha256(content).hexdigest()[:32]
        name, size = f"retake_page_{number}", packed.stat().st_size
        assembler.append(f'.balign 16\n.globl {name}\n{name}:\n.incbin "{packed}"\n')
        declarations.append(f"extern const char {name}[{size}];")
        rows.append(f'    {{"{path}", "{TYPES[file.suffix]}", "{etag}", {{{name}, {size}}}}},')
    assembler.append('.section .note.GNU-stack, "", %progbits\n')
    (out / "page_bytes.S").write_text("".join(assembler))
    (out / "page_table.cpp").write_text(
        "// Written by web/embed.py.\n"
        '#include "web/page_files.h"\n\n'
        'extern "C" {\n' + "\n".join(declarations) + "\n}\n\n"
        "namespace retake {\n\n"
        "std::span<const PageFile> page_files() {\n"
        "  static constexpr PageFile files[] = {\n" + "\n".join(rows) + "\n  };\n"
        "  return files;\n}\n\n}  // namespace retake\n"
    )


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["list", web]:
            print("\n".join(str(file) for _, file in page_files(pathlib.Path(web))))
        case ["write", web, out]:
            write(pathlib.Path(web).resolve(), pathlib.Path(out).resolve())
        case _:
            sys.exit(__doc__)
