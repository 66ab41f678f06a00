"""Measures chains alone and behind the store, bowling throws, marbles, dice, and the daemon while chains keep every core busy.

Usage: bench.py BUILD_FOLDER [sampler] [--quick]. Prints one table; see README.md, "How fast it is". `sampler` measures
what the methods of a chain are worth against each other instead.
"""
import http.client
import json
import pathlib
import random
import re
import signal
import subprocess
import sys
import tempfile
import time

build = pathlib.Path(sys.argv[1])
quick = "--quick" in sys.argv
samples_wanted = 10_000 if quick else 100_000
rows = []


def row(name, value, unit, bar=""):
    rows.append((name, f"{value:,.3g}" if value < 1000 else f"{value:,.0f}", unit, bar))


def ask(connection, method, path, body=None):
    headers = {"Content-Type": "application/json"} if body is not None else {}
    connection.request(method, path, None if body is None else json.dumps(body), headers)
    response = connection.getresponse()
    text = response.read()
    if response.status >= 400:
        raise RuntimeError(f"{method} {path}: {response.status} {text[:300]}")
    return json.loads(text) if text else None


def resident_megabytes(pid):
    status = pathlib.Path(f"/proc/{pid}/status").read_text()
    return int(re.search(r"VmRSS:\s+(\d+)", status)[1]) / 1024


def start_chains(connection, constraint, request):
    scenario = ask(connection, "POST", "/v1/scenarios", {"world": "ball2d", "constraints": [constraint]})
    return scenario["id"], ask(connection, "POST", f"/v1/scenarios/{scenario['id']}/chains", request)["chains"]


def measure_figures(program, arguments, bars):
    output = subprocess.run([build / program, *arguments], check=True, capture_output=True, text=True).stdout
    for line in output.splitlines():
        figure = json.loads(line)
        bar = next((bar for name, bar in bars.items() if figure["name"].startswith(name)), "")
        row(figure["name"], figure["value"], figure["unit"], bar)


def measure_chains():
    measure_figures("bench_chain", ["0.3", "2"] if quick else ["2", "8"], {
        "bare chain, metropolis": "2,000,000",
        "bare chain, rejection": "2,000,000",
        "chain + store / bare chain": "0.85",
    })


def measure_bowling():
    measure_figures("bench_bowling", ["--quick"] if quick else [], {
        "bowling, prior draws": "350",
        "bowling, ours / naive": "8",
        # How many steps ends these names.
        "leave the 6-7, rejection: early rejection on / off": "1.4",
        "leave the 6-7, metropolis: early rejection on / off": "1.4",
        # How many seeds ends these names.
        "strike: first sample": "0.5",
        "leave 6-7: first sample": "5",
        "spare 6-7: first sample": "3",
        "seven-ten: first sample": "3",
    })


def measure_marbles():
    measure_figures("bench_spelling", ["--quick"] if quick else [], {
        "marbles, HI: full simulations": "300",
        "marbles, HI: ours / Bullet": "8",
        "marbles, ACM: full simulations": "90",
        "marbles, ACM: ours / Bullet": "8",
        "marbles, ACM: local re-simulation": "1",
        "marbles, 81 in 40 x 7: local re-simulation": "2",
    })
    measure_figures("bench_words", ["--quick"] if quick else [], {
        # How many seeds ends these names.
        "HI, conditional: first complete, worst": "0.1",
        "ACM, conditional: first complete, worst": "0.2",
        "85 balls in 40 x 7, conditional: first complete, worst": "1",
        "all bins of 15 x 7, conditional: first complete, worst": "1",
        "ACM, metropolis: first complete, worst": "2",
        "ACM: distinct orders": "5,000",
        "ACM: effective samples, bin of the median slot": "200",
    })


def measure_dice():
    measure_figures("bench_dice", ["--quick"] if quick else [], {
        "dice: full simulations": "2,000",
    })
    firsts = {"1, pose random": {"4 mm": "1", "1 mm": "1", "0.1 mm": "1"}, "1, pose fixed": {"4 mm": "1", "1 mm": "5"},
              "2, pose random": {"4 mm": "3", "1 mm": "30"}, "3, pose random": {"4 mm": "3", "1 mm": "30"},
              "6, pose random": {"4 mm": "10", "1 mm": "30"}}
    measure_figures("bench_throws", ["--quick"] if quick else [], {
        f"dice: first of {dice}, within {tolerance}, worst": bar
        for dice, bars in firsts.items() for tolerance, bar in bars.items()
    } | {
        name: bar for tolerance in ("4 mm", "1 mm", "0.1 mm") for name, bar in (
            (f"dice: one with its face within {tolerance}, placed with roulette", "4,000"),
            (f"dice: one with its face within {tolerance}, placed", "1,000"))
    })


def measure_daemon(folder):
    daemon = subprocess.Popen(
        [build / "retake", "serve", "--listen", "127.0.0.1:0", "--store", folder / "bench.db", "--threads", "2",
         "--no-examples"], stdout=subprocess.PIPE, text=True)
    try:
        port = int(re.search(r":(\d+)/", daemon.stdout.readline())[1])
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
        row("resident memory, idle", resident_megabytes(daemon.pid), "MB")

        # A large stock, found by two chains.
        begin = time.monotonic()
        wide = {"kind": "rest_position", "x": 0, "sd": 100, "tolerance": 100}
        stock, chains = start_chains(connection, wide,
                                     {"count": 2, "method": "rejection", "stop": {"samples": samples_wanted // 2}})
        while any(chain["state"] == "running" for chain in chains):
            time.sleep(0.2)
            chains = ask(connection, "GET", f"/v1/scenarios/{stock}/chains")["chains"]
        row("samples stored, two chains that keep every draw", samples_wanted / (time.monotonic() - begin), "samples/s")
        row(f"resident memory, {samples_wanted:,} samples", resident_megabytes(daemon.pid), "MB", "200")

        # Pages anywhere in the stock.
        cursors, cursor = [""], ""
        while True:
            page = ask(connection, "GET", f"/v1/scenarios/{stock}/samples?limit=500{cursor and '&cursor=' + cursor}")
            cursor = page.get("next_cursor", "")
            if not cursor:
                break
            cursors.append(cursor)
        times = []
        for chosen in random.Random(1).choices(cursors, k=200):
            begin = time.perf_counter()
            ask(connection, "GET", f"/v1/scenarios/{stock}/samples?limit=50{chosen and '&cursor=' + chosen}")
            times.append((time.perf_counter() - begin) * 1e3)
        times.sort()
        row("a page of 50 samples, median", times[100], "ms")
        row("a page of 50 samples, 99th percentile", times[198], "ms", "10")

        # Plays while chains keep both cores busy: a wish that is all but impossible.
        _, busy = start_chains(connection, {"kind": "rest_position", "x": 900, "sd": 1e-6, "tolerance": 1e-6},
                               {"count": 2, "method": "rejection"})
        seconds = 2 if quick else 10
        output = subprocess.run(
            ["wrk", "-t1", "-c4", f"-d{seconds}s", "-s", pathlib.Path(__file__).parent / "plays.lua",
             f"http://127.0.0.1:{port}/v1/scenarios/{stock}/plays"], check=True, capture_output=True, text=True).stdout
        requests, microseconds, p99, errors = map(int, re.search(r"figures (\d+) (\d+) (\d+) (\d+)", output).groups())
        row("plays while chains keep both cores busy", requests / microseconds * 1e6, "plays/s", "2,000")
        row("a play, 99th percentile", p99 / 1e3, "ms", "10")
        row("plays that failed", errors, "")
        after = [ask(connection, "GET", f"/v1/chains/{chain['id']}") for chain in busy]
        row("iterations of the chains meanwhile", sum(c["iterations_per_second"] for c in after), "iterations/s")
    finally:
        daemon.send_signal(signal.SIGTERM)
        daemon.wait(60)


if "sampler" in sys.argv:
    measure_figures("bench_sampler", ["--quick"] if quick else [], {})
else:
    measure_chains()
    measure_bowling()
    measure_marbles()
    measure_dice()
    with tempfile.TemporaryDirectory() as temporary:
        measure_daemon(pathlib.Path(temporary))
widths = [max(len(cells[k]) for cells in rows) for k in range(4)]
print(f"{'':{widths[0]}}  {'measured':>{widths[1]}}  {'':{widths[2]}}  bar")
for name, value, unit, bar in rows:
    print(f"{name:{widths[0]}}  {value:>{widths[1]}}  {unit:{widths[2]}}  {bar}")
