"""Synthesis, place and route of a board's gateware by `dermis place`, and the figures of what came out.

```text
python -m dermis_litex.route build/gateware/*/gateware.json
```

prints the figures of several runs as a table in Markdown.
"""

import argparse
import json
import os
import subprocess
from pathlib import Path

FIGURES = "gateware.json"
# The program: of PATH, unless the environment names it.
DERMIS = os.environ.get("DERMIS", "dermis")


class RouteError(RuntimeError):
    """`dermis place` is missing, or failed, of which it has said why."""


def route(script, design, arguments):
    """Makes the gateware that `dermis_litex.gateware` wrote; the figures, which `gateware.json` beside its `script` has too.

    `design` says what it is; `arguments` are those of `dermis place`. If no seed reaches all clocks there is no bitstream.

    Raises `RouteError`.
    """
    path = script.with_name(FIGURES)
    path.unlink(missing_ok=True)
    try:
        done = subprocess.run([DERMIS, "place", script, *arguments], stdout=subprocess.PIPE, encoding="utf-8")
    except FileNotFoundError as error:
        raise RouteError(f"{DERMIS} is not on PATH, and DERMIS does not name it") from error
    if not done.stdout:
        raise RouteError(f"dermis place failed; logs in {script.parent}")
    figures = design | json.loads(done.stdout)
    path.write_text(json.dumps(figures, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    return figures


WHAT = ("board", "device", "scene", "array")
HEADER = (*WHAT, "LUTs", "flip-flops", "block RAMs", "multipliers", "clock, MHz", "Ethernet, MHz", "seed")


def row(figures):
    """The columns of a table's row."""
    counts = [f"{own['used']} of {own['available']}" for own in figures["cells"].values()]
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
