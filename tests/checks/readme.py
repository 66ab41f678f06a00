#!/usr/bin/env python3
"""Runs the README's commands: `scripts/serve` as it stands there, then every other ```sh block against that daemon.

Usage: readme.py SOURCE_FOLDER. The port and the store are replaced, so that a running daemon is not disturbed.
"""
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile

root = pathlib.Path(sys.argv[1]).resolve()
blocks = re.findall(r"^```sh\n(.*?)^```", (root / "README.md").read_text(), re.M | re.S)
if len(blocks) != 3 or "scripts/serve" not in blocks[0] or "scripts/test" not in blocks[0]:
    sys.exit(f"expected the two commands and two tours in README.md, found {len(blocks)} blocks")

with tempfile.TemporaryDirectory() as folder:
    daemon = subprocess.Popen([root / "scripts/serve", "--listen", "127.0.0.1:0", "--store", f"{folder}/retake.db"],
                              stdout=subprocess.PIPE, text=True)
    try:
        port = re.search(r":(\d+)/", daemon.stdout.readline())[1]
        os.symlink(root / "build", f"{folder}/build")
        for block in blocks[1:]:
            script = block.replace("127.0.0.1:8080", f"127.0.0.1:{port}")
            print(script)
            done = subprocess.run(["bash", "-euo", "pipefail", "-c", script], cwd=folder, capture_output=True, text=True)
            print(done.stdout, done.stderr)
            if done.returncode != 0:
                sys.exit(f"exit code {done.returncode}")
            # Every line of the tour says something: two chains, a play, and the samples that there are by then.
            if "jq" in block and len(done.stdout.splitlines()) < 4:
                sys.exit("the tour printed too little")
        documents = list(pathlib.Path(folder, "animations").glob("*.json"))
        if len(documents) != 3:
            sys.exit(f"retake sample wrote {len(documents)} documents")
    finally:
        daemon.send_signal(signal.SIGTERM)
        if daemon.wait(60) != 0:
            sys.exit("the daemon did not end in good order")
