# SPDX-License-Identifier: MIT
"""Makes the tables and pictures of docs/trade.md, by the commands that the page itself gives.

    python3 trade.py NMM [--only NAME]... [--quick] [--docs FOLDER]

Before each part of the page stands a block with one `nmm trade`; of its table the rows of a few knobs
are shown, with what it named. Of a part that compares orders it is run with each of them, and the
quickest size within each error is shown.
"""

import json
import os
import re
import shlex
import shutil
import subprocess
import tempfile

from pages import ROOT, make_parts, number, read_choices, table, tell_machine, write_part

# Part of the page: knobs whose rows are shown.
KNOBS = {"cantilever": ("scene", "size", "order", "mesh", "scheme", "tolerance"),
         "swing": ("scene", "size", "dt", "size with dt", "order", "mesh", "scheme"),
         "bar": ("scene", "size", "dt", "size with dt", "order", "scheme", "penalty"),
         "strut": ("scene", "size", "dt", "size with dt", "order", "mesh", "tolerance"),
         "incline": ("scene", "dt", "size with dt", "order", "mesh", "tolerance"),
         "arch": ("scene", "size", "order", "mesh", "penalty")}

# Part of the page: errors [%] at which the three orders are compared.
ORDERS = {"orders_cantilever": (10, 3, 1, 0.3, 0.1), "orders_arch": (50, 30, 20, 10, 5)}
PARTS = [*KNOBS, *ORDERS]


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


def quickest(rows, error):
    within = [r for r in rows if r["end"] == "completed" and r["error"] <= error]
    if not within:
        return ["", ""]
    best = min(within, key=lambda r: r["seconds"])
    return [number(best["unknowns"]), number(best["seconds"])]


def compare_orders(results, errors):
    rows = [[number(error)] + [cell for result in results for cell in quickest(result["rows"], error)]
            for error in errors]
    head = [f"{what} order {order}" for order in range(3) for what in ("unknowns,", "time [s],")]
    return table(["error [%]", *head], rows)


def measure(program, words, quick, folder):
    # 1: no setting has the error wanted, which is an answer.
    done = subprocess.run([program, *words, "--json", "-o", folder, *["--quick"] * quick], cwd=ROOT,
                          stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode not in (0, 1):
        raise SystemExit(f"{' '.join(words)}: ended with status {done.returncode}")
    picture = next(name for name in os.listdir(folder) if name.endswith(".svg"))
    return json.loads(done.stdout), os.path.join(folder, picture)


def make_part(given, part, page):
    """Text of a part; its picture is put where the page wants it."""
    words = command_of(page, part)
    with tempfile.TemporaryDirectory() as folder:
        if part in ORDERS:
            each = [[*words, "--set", f"covers.order={order}"] for order in range(3)]
            results = [measure(given.nmm, one, given.quick, folder)[0] for one in each]
            return compare_orders(results, ORDERS[part])
        result, picture = measure(given.nmm, words, given.quick, folder)
        if f"pictures/trade-{part}.svg" in page:
            shutil.copyfile(picture, os.path.join(given.docs, "pictures", f"trade-{part}.svg"))
        return show(result, KNOBS[part])


def main():
    given = read_choices("Tables and pictures of docs/trade.md", PARTS, "few settings")
    path = os.path.join(given.docs, "trade.md")
    with open(path, encoding="utf-8") as file:
        page = file.read()
    took = make_parts(given.only or PARTS, lambda part: write_part(
        path, part, make_part(given, part, page)))
    if not given.only:
        tell_machine(path, given.nmm, took)


if __name__ == "__main__":
    main()
