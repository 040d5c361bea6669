# SPDX-License-Identifier: MIT
"""Makes the tables and pictures of docs/trade.md, by the commands that the page itself gives.

    python3 trade.py NMM [--only NAME]... [--quick] [--docs FOLDER]

Before each part of the page stands a block with one `nmm trade`; of its table the rows of a few knobs
are shown, with what it named.
"""

import argparse
import json
import os
import re
import shlex
import shutil
import subprocess
import tempfile
import time

from pages import ROOT, machine, minutes, number, table, write_part

# Part of the page: knobs whose rows are shown.
KNOBS = {"cantilever": ("scene", "size", "order", "mesh", "scheme", "tolerance"),
         "swing": ("scene", "size", "dt", "size with dt", "order", "mesh", "scheme"),
         "bar": ("scene", "size", "dt", "size with dt", "order", "scheme", "penalty"),
         "strut": ("scene", "size", "dt", "size with dt", "order", "mesh", "tolerance"),
         "incline": ("scene", "dt", "size with dt", "order", "mesh", "tolerance"),
         "arch": ("scene", "size", "order", "mesh", "penalty")}


def command_of(page, part):
    """Words of the last `nmm trade` before the part."""
    before = page.split(f"<!-- bench: {part} -->")[0]
    found = re.findall(r"```sh\n(nmm trade .*?)```", before, re.S)[-1]
    return shlex.split(found.replace("\\\n", " "))[1:]


def show(result, knobs):
    rows = [[f"`{r['setting']}`" if "=" in r["setting"] else r["setting"], number(r["unknowns"]),
             number(r["seconds"]), number(r["error"]) if r["end"] == "completed" else r["end"],
             r["pareto"]]
            for r in result["rows"] if r["knob"] in knobs]
    body = table(["*setting", "unknowns", "time [s]", "error [%]", "*Pareto"], rows)
    if result.get("options"):
        body += f"\n\nNamed: `{result['options']}`."
    elif result.get("why"):
        body += f"\n\nNone is named: {result['why']}."
    return body


def measure(program, part, page, quick, folder):
    words = command_of(page, part)
    # 1: no setting has the error wanted, which is an answer.
    done = subprocess.run([program, *words, "--json", "-o", folder, *["--quick"] * quick], cwd=ROOT,
                          stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode not in (0, 1):
        raise SystemExit(f"{part}: ended with status {done.returncode}")
    picture = next(name for name in os.listdir(folder) if name.endswith(".svg"))
    return json.loads(done.stdout), os.path.join(folder, picture)


def main():
    parser = argparse.ArgumentParser(description="Tables and pictures of docs/trade.md")
    parser.add_argument("nmm", help="the program")
    parser.add_argument("--only", action="append", choices=KNOBS, help="only this part")
    parser.add_argument("--quick", action="store_true", help="a try: few settings")
    parser.add_argument("--docs", default=os.path.join(ROOT, "docs"), help="folder of the page")
    given = parser.parse_args()
    program, path = os.path.abspath(given.nmm), os.path.join(given.docs, "trade.md")
    os.makedirs(os.path.join(given.docs, "pictures"), exist_ok=True)
    took = 0
    with open(path, encoding="utf-8") as file:
        page = file.read()
    for part in given.only or KNOBS:
        print(f"{part} ...", end=" ", flush=True)
        start = time.monotonic()
        with tempfile.TemporaryDirectory() as folder:
            result, picture = measure(program, part, page, given.quick, folder)
            if f"pictures/trade-{part}.svg" in page:
                shutil.copyfile(picture, os.path.join(given.docs, "pictures", f"trade-{part}.svg"))
        write_part(path, part, show(result, KNOBS[part]))
        print(minutes(time.monotonic() - start), flush=True)
        took += time.monotonic() - start
    print(f"all: {minutes(took)}")
    if not given.only:
        write_part(path, "machine", f"{machine(program)}\nMeasured in {minutes(took)}.")


if __name__ == "__main__":
    main()
