"""Synthesis, place and route of a board's gateware with Yosys and nextpnr, and the figures of what came out.

```text
python -m dermis_litex.route build/gateware/*/gateware.json
```

prints the figures of several runs as a table in Markdown.
"""

import argparse
import json
import math
import shutil
import subprocess
from pathlib import Path

FIGURES, BITSTREAM = "gateware.json", "board.bit"
# `make tools` installs the tools from PyPI under the second name.
PREFIXES = ("", "yowasp-")
INSTALL = "`make setup tools` installs Yosys, and nextpnr and ecppack into build/tools/bin"
# As `dermis bitstream` does: placers in the order in which they are tried, and three times the default weight of timing, because
# half of the longest paths and more is wire.
PLACERS = ("static", "heap")
PLACE_OPTIONS = ("--timing-allow-fail", "--placer-heap-timingweight", "30")
# Lines at the end of a tool's log that an error repeats.
LOG_LINES = 12
# Names of the figures, with nextpnr's names of the cells: look-up tables include carries and distributed RAM.
CELLS = {
    "luts": "TRELLIS_COMB",
    "flip_flops": "TRELLIS_FF",
    "block_rams": "DP16KD",
    "multipliers": "MULT18X18D",
}
# How far a constraint may be from the clock that is wanted: nextpnr counts periods in picoseconds.
ROUNDING = 1e-3


class RouteError(RuntimeError):
    """A tool is missing or failed, or wrote what it should not have written."""


def find_tool(name):
    """The path of a tool, under one of the names that it is installed with.

    Raises `RouteError` if it is not on PATH.
    """
    names = [prefix + name for prefix in PREFIXES]
    paths = filter(None, map(shutil.which, names))
    path = next(paths, None)
    if path is None:
        raise RouteError(f"{' or '.join(names)} is not on PATH; {INSTALL}")
    return path


def version_of(tool):
    """What a tool says of its version: the first line with a digit."""
    done = subprocess.run([tool, "--version"], capture_output=True, text=True)
    lines = (done.stdout + done.stderr).splitlines()
    return next((line.strip() for line in lines if any(map(str.isdigit, line))), "")


def run(tool, arguments, folder, log, minutes):
    """Runs a tool in a folder; its output goes to the file `log` there.

    Raises `RouteError` with the end of the log if it fails or takes longer than `minutes`.
    """
    path = folder / log
    with path.open("w", encoding="utf-8") as file:
        try:
            done = subprocess.run(
                [tool, *arguments], cwd=folder, stdin=subprocess.DEVNULL, stdout=file, stderr=file, timeout=60 * minutes
            )
        except subprocess.TimeoutExpired as error:
            raise RouteError(f"{Path(tool).name} took longer than {minutes} min; log: {path}") from error
    if done.returncode:
        end = "\n".join(path.read_text(encoding="utf-8", errors="replace").splitlines()[-LOG_LINES:])
        raise RouteError(f"{Path(tool).name} failed; {path} ends with:\n{end}")


def longest_path(paths, net):
    """Of nextpnr's longest path of a clock's net to itself: its ends, and the ns of logic and of wires; None without one."""
    edge = f"posedge {net}"
    steps = next((own["path"] for own in paths if own["from"] == own["to"] == edge), None)
    if steps is None:
        return None
    delay = lambda is_wire: round(sum(step["delay"] for step in steps if (step["type"] == "routing") == is_wire), 2)
    ends = {"from": steps[0]["from"]["cell"], "to": steps[-1]["to"]["cell"]}
    return ends | {"logic_ns": delay(False), "wires_ns": delay(True)}


def read_report(report, clocks):
    """Cells and clocks of a report of nextpnr.

    `clocks` are those that must be there: of each a part of its net's name, and the MHz that it must reach.

    Raises `RouteError` if a clock is missing, has another constraint, or is not known.
    """
    fmax, known = report["fmax"], set()
    figures = {}
    for name, clock in clocks.items():
        nets = [net for net in fmax if clock["net"] in net]
        if len(nets) != 1:
            found = f"{len(nets)} of nextpnr's clocks have this in their names: {', '.join(fmax)}"
            raise RouteError(f"clock {name}, {clock['net']}: {found}")
        (net,) = nets
        known.add(net)
        if abs(fmax[net]["constraint"] / clock["wanted_MHz"] - 1) > ROUNDING:
            raise RouteError(f"clock {name}: nextpnr was told {fmax[net]['constraint']:.3f} MHz, not {clock['wanted_MHz']:g}")
        figures[name] = clock | {
            # Rounded down: a clock that is just missed is missed.
            "reached_MHz": math.floor(fmax[net]["achieved"] * 100) / 100,
            "longest_path": longest_path(report["critical_paths"], net),
        }
    if others := fmax.keys() - known:
        raise RouteError(f"clocks {', '.join(others)}: known are {', '.join(clock['net'] for clock in clocks.values())}")
    used = report["utilization"]
    cells = {name: {"used": used[cell]["used"], "available": used[cell]["available"]} for name, cell in CELLS.items()}
    return {"cells": cells, "clocks": figures}


def missed(figures):
    """The clocks that are not reached, each as text."""
    return [
        f"{name} {clock['reached_MHz']} of {clock['wanted_MHz']:g} MHz"
        for name, clock in figures["clocks"].items()
        if clock["reached_MHz"] < clock["wanted_MHz"]
    ]


def slack(figures):
    """How much of the wanted clock is reached by the slowest one."""
    return min(clock["reached_MHz"] / clock["wanted_MHz"] for clock in figures["clocks"].values())


def place(folder, tool, arguments, seed, minutes):
    """Places and routes with a seed and the first placer that converges; which one, and nextpnr's report."""
    name = f"seed{seed}"
    for placer in PLACERS:
        own = ["--seed", str(seed), "--placer", placer, "--textcfg", f"{name}.config", "--report", f"{name}.report.json"]
        try:
            run(tool, [*arguments, *PLACE_OPTIONS, *own], folder, f"{name}.{placer}.log", minutes)
            return placer, json.loads((folder / f"{name}.report.json").read_text(encoding="utf-8"))
        except RouteError as error:
            failure = error
    raise failure


def route(folder, design, arguments, seeds, minutes):
    """Makes the gateware that `dermis_litex.gateware` wrote into a folder; the figures, which `gateware.json` there has too.

    `design` says what it is, with `clocks` as `read_report` takes them; `arguments` are nextpnr's for device and pins. Seeds from
    1 on are tried until one reaches all clocks; of `seeds` that miss them the best is taken, and there is no bitstream.

    Raises `RouteError`: a tool is missing or failed.
    """
    yosys, nextpnr, ecppack = map(find_tool, ("yosys", "nextpnr-ecp5", "ecppack"))
    for name in (FIGURES, BITSTREAM):
        (folder / name).unlink(missing_ok=True)
    run(yosys, ["-q", "-l", "board.rpt", "board.ys"], folder, "synthesis.log", minutes)
    best = None
    for seed in range(1, seeds + 1):
        placer, report = place(folder, nextpnr, ["--json", "board.json", *arguments], seed, minutes)
        placed = read_report(report, design["clocks"]) | {"seed": seed, "placer": placer}
        if best is None or slack(placed) > slack(best):
            best = placed
        if not missed(placed):
            break
    is_met = not missed(best)
    if is_met:
        run(ecppack, ["--compress", f"seed{best['seed']}.config", BITSTREAM], folder, "pack.log", minutes)
    tools = {"yosys": version_of(yosys), "nextpnr-ecp5": version_of(nextpnr)}
    figures = design | best | {"is_met": is_met, "bitstream": BITSTREAM if is_met else None, "tools": tools}
    (folder / FIGURES).write_text(json.dumps(figures, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    return figures


WHAT = ("board", "device", "scene", "array")
HEADER = (*WHAT, "LUTs", "flip-flops", "block RAMs", "multipliers", "clock, MHz", "Ethernet, MHz", "seed")


def row(figures):
    """The columns of a table's row."""
    cells = [figures["cells"][name] for name in CELLS]
    counts = [f"{own['used']} of {own['available']}" for own in cells]
    clocks = [f"{own['reached_MHz']:.2f} of {own['wanted_MHz']:g}" for own in figures["clocks"].values()]
    return [*(figures[name] for name in WHAT), *counts, *clocks, str(figures["seed"])]


def table(runs):
    """The figures of runs as a table in Markdown."""
    rows = [HEADER, ["---"] * len(WHAT) + ["---:"] * (len(HEADER) - len(WHAT)), *map(row, runs)]
    return "\n".join(f"| {' | '.join(columns)} |" for columns in rows)


def main():
    parser = argparse.ArgumentParser(
        prog="python -m dermis_litex.route", description="Print the figures of gateware as a table in Markdown"
    )
    parser.add_argument("figures", type=Path, nargs="+", help=f"{FIGURES}, as `python -m dermis_litex.gateware --run` writes it")
    print(table([json.loads(path.read_text(encoding="utf-8")) for path in parser.parse_args().figures]))


if __name__ == "__main__":
    main()
