# SPDX-License-Identifier: MIT
"""The tables of docs/solvers.md, between its lines `<!-- bench: NAME -->` and `<!-- end -->`."""

import os
import platform
import re
import subprocess

from results import groups, lines, short

PEERS = ("petsc-cg-jacobi", "petsc-cg-2x2", "petsc-cg-icc0", "petsc-cg-icc1", "petsc-cg-icc3",
         "petsc-gamg", "eigen-cg-diagonal", "eigen-cg-icc", "petsc-cholesky", "mumps", "eigen-ldlt", "cholmod")
OURS = ("pcg-cover", "pcg-cluster", "pcg-body", "chebyshev-cover", "chebyshev-cluster")
# What the project asks of itself.
PAPER_SIZE = 3000
TIMES_FASTER = 3
AUTO_MAY_LOSE = 1.15
# Two threads over one: anywhere, and from so many unknowns on.
LEAST_GAIN, SHARED_FROM, SHARED_GAIN = 0.95, 20000, 1.8
# Of a sweep over a triad, once the system leaves the caches.
LEAST_BANDWIDTH, FAR_FROM = 0.8, 100000


def table(head, rows):
    """Markdown; the first column to the left, numbers to the right."""
    if not rows:
        return "Not measured."
    text = ["| " + " | ".join(head) + " |", "|---|" + "--:|" * (len(head) - 1)]
    return "\n".join(text + ["| " + " | ".join(row) + " |" for row in rows])


def time_of(cell):
    return short(cell.ms) if cell else "-"


def time_or_reason(group, method):
    cell = group.get(method)
    return short(cell.ms) if cell else group.why_not(method)


def named(cell):
    return f"{short(cell.ms)} {cell.method}" if cell else "-"


def ratio(numerator, denominator):
    """Peer over ours; bold where ours loses."""
    if numerator is None or denominator is None:
        return "-"
    value = round(numerator.ms / denominator.ms, 2)
    return f"**{value:.2f}**" if value < 1 else f"{value:.2f}"


def bold_above(part):
    """auto's time over another; bold beyond what auto may lose."""
    return f"**{part:.2f}**" if round(part, 2) > AUTO_MAY_LOSE else f"{part:.2f}"


def over(auto, best):
    """auto over the best fixed choice, and which that is; bold beyond what auto may lose."""
    if auto is None or best is None:
        return "-"
    return f"{bold_above(auto.ms / best.ms)} {best.method}"


def place(group):
    """System, unknowns, Courant number: the first columns of most tables."""
    return [re.sub("_C.*", "", group.system), str(group.order), f"{group.courant:.3g}"]


# --- The tables


def machine(_):
    # The model only: flags and caches of the processor do not help to read the tables.
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        model = re.search(r"model name\s*:\s*(.*)", file.read()).group(1)
    packages = ("libpetsc-real-dev", "libeigen3-dev", "libsuitesparse-dev", "libopenblas0-pthread",
                "gcc")
    versions = subprocess.run(["dpkg-query", "-W", "-f", "${Package} ${Version}, ", *packages],
                              stdout=subprocess.PIPE, text=True, check=False).stdout.strip(", ")
    return f"{model}, {os.cpu_count()} cores, {platform.system()}; {versions}."


def against_peers(tolerance):
    def make(folder):
        rows = []
        for g in groups(folder, "peers_*"):
            if g.tolerance != tolerance:
                continue
            one, two = g.get("auto", 1), g.get("auto", 2)
            # Method, blocks, precision; behind them comes the number of threads.
            took = one.note.split("|")[0].strip().rsplit(" ", 1)[0] if one else "-"
            rows.append(place(g) + [time_of(one), time_of(two), took, over(one, g.best("ours")),
                                    named(g.best("iterative")), ratio(g.best("iterative"), one),
                                    ratio(g.best("iterative", 2), two), named(g.best("direct")),
                                    ratio(g.best("direct"), one), ratio(g.best("direct", 2), two)])
        return table(["system", "unknowns", "C", "auto, 1 thread", "auto, 2", "auto took",
                      "auto over best fixed choice", "best iterative peer", "its ratio",
                      "2 threads", "best direct peer", "its ratio", "2 threads"], rows)
    return make


def all_peers(tolerance):
    def make(folder):
        rows = [place(g) + [time_of(g.get("auto"))] + [time_or_reason(g, p) for p in PEERS]
                for g in groups(folder, "peers_*") if g.tolerance == tolerance]
        return table(["system", "unknowns", "C", "auto", *PEERS], rows)
    return make


def verdict(folder):
    """How often auto wins, in words."""
    text = []
    for threads in (1, 2):
        won, lost, paper = 0, [], []
        for g in groups(folder, "peers_*"):
            auto = g.get("auto", threads)
            for family in ("iterative", "direct"):
                peer = g.best(family, threads)
                if peer is None or (auto is None and g.get("auto") is not None):
                    continue
                # What auto does not solve and another one does is lost.
                value = peer.ms / auto.ms if auto else 0
                won += value >= 1
                if value < 1:
                    lost.append(value)
                if family == "iterative" and g.order <= PAPER_SIZE:
                    paper.append((value, g.system))
        if not paper:
            continue
        below = sorted({name for value, name in paper if value < TIMES_FASTER})
        reached = sum(value >= TIMES_FASTER for value, _ in paper)
        name = "one thread" if threads == 1 else "two threads"
        text.append(f"On {name} auto is no slower than the best iterative and the best direct peer "
                    f"in {won} of {won + len(lost)} comparisons" +
                    (f", and slower in {len(lost)}, at worst {slower(min(lost))}."
                     if lost else "."))
        text.append(f"At paper size it is at least {TIMES_FASTER} times faster than the best "
                    f"iterative peer in {reached} of {len(paper)} cells; the ratios go from "
                    f"{min(paper)[0]:.2f} to {max(paper)[0]:.2f}" +
                    (f"; below {TIMES_FASTER}: {', '.join(below)}." if below else "."))
    unsolved = [at_step(g) + f" to {g.tolerance}" for g in groups(folder, "peers_*")
                if not any(c.ms is not None for c in g.cells)]
    if text and unsolved:
        text.append(f"Not counted, because nothing solves it: {', '.join(unsolved)}.")
    return "\n".join(text) if text else "Not measured."


def slower(value):
    return f"{1 / value:.2f} times as slow" if value > 0 else "not solved at all"


def at_step(group):
    return f"{place(group)[0]} at C = {group.courant:.3g}"


def goal(text, cells, least):
    """How many of the cells (value, name) reach a goal, and which do not."""
    below = [f"{name} {value:.2f}" for value, name in cells if value < least]
    return (f"{text} in {len(cells) - len(below)} of {len(cells)}" +
            (f"; less: {', '.join(below)}." if below else "."))


def threads_verdict(folder):
    """What two threads gain, against the goals, in words."""
    found = [(g, g.get("auto", 1), g.get("auto", 2)) for g in groups(folder, "peers_*")
             if g.tolerance == "1e-06"]
    cells = [(g.order, round(one.ms / two.ms, 2), at_step(g)) for g, one, two in found if one and two]
    if not cells:
        return "Not measured."
    text = [goal(f"auto on two threads is at least {LEAST_GAIN} times as fast as on one",
                 [cell[1:] for cell in cells], LEAST_GAIN),
            goal(f"From {SHARED_FROM} unknowns on it is at least {SHARED_GAIN} times as fast",
                 [cell[1:] for cell in cells if cell[0] >= SHARED_FROM], SHARED_GAIN)]
    turns = [(round(float(at[8]), 2), f"{at[4]} on {re.sub('.*/|_C.*', '', at[1])} at C = {at[3]}")
             for at in (line.split("\t") for line in lines(folder, "threads"))]
    if turns:
        text.append(goal("In turns (the last table of this section) it is, whatever the method,",
                         turns, SHARED_GAIN))
    return "\n".join(text)


def bandwidth_verdict(folder):
    cells = []
    for line in lines(folder, "bandwidth"):
        _, _, order, _, n_thread, _, sweep, triad = line.split("\t")
        if int(order) >= FAR_FROM:
            cells.append((float(sweep) / float(triad), f"{order} unknowns on {n_thread}"))
    return goal(f"Out of the caches a sweep takes at least {LEAST_BANDWIDTH} of the triad's bandwidth",
                cells, LEAST_BANDWIDTH) if cells else "Not measured."


def threads(folder):
    methods = ("auto", "pcg-cover", "pcg-cluster", "pcg-cluster-mixed", "pcg-body")
    rows = []
    for g in groups(folder, "peers_*"):
        if g.tolerance != "1e-06" or g.get("auto", 2) is None or g.get("auto") is None:
            continue
        one, two = g.get("auto"), g.get("auto", 2)
        row = place(g) + [time_of(one), time_of(two)]
        for method in methods:
            row.append(ratio(g.get(method, 1), g.get(method, 2)))
        rows.append(row)
    return table(["system", "unknowns", "C", "auto, 1 thread ms", "auto, 2 threads ms"] +
                 [f"{m}: 1 over 2" for m in methods], rows)


def scaling(folder):
    rows = []
    for line in lines(folder, "threads"):
        _, path, order, courant, asked, took, one, two, gained, allowed = line.split("\t")
        rows.append([re.sub(".*/|_C.*", "", path), order, courant, asked, took, short(float(one)),
                     short(float(two)), f"{float(gained):.2f}", f"{float(allowed):.2f}"])
    return table(["system", "unknowns", "C", "asked for", "took", "1 thread ms", "2 threads ms",
                  "1 over 2", "two solves at once"], rows)


def bandwidth(folder):
    rows = []
    for line in lines(folder, "bandwidth"):
        _, _, order, size, n_thread, micro, sweep, triad = line.split("\t")
        rows.append([order, f"{float(size) / 1e6:.3g}", n_thread, micro, sweep, triad,
                     f"{100 * float(sweep) / float(triad):.0f} %"])
    return table(["unknowns", "megabytes a sweep", "threads", "us a sweep", "sweep GB/s",
                  "triad GB/s", "part"], rows)


def sweeps(count, end):
    """Number of sweeps, or why there is none."""
    return count if end == "converged" else end.split(" (")[0]


def jacobi_lines(folder, name):
    """(file, unknowns, C, lambda_max, plain, damped) of each system; the last two as words."""
    for line in lines(folder, name):
        _, path, order, courant, largest, plain, plain_end, damped, damped_end = line.split("\t")
        yield (re.sub(r".*/|\.sys$", "", path), order, float(courant), largest,
               sweeps(plain, plain_end), sweeps(damped, damped_end))


def by_mass(folder):
    """C -> lumped or consistent -> lambda_max, plain, damped."""
    found = {}
    for name, _, courant, *rest in jacobi_lines(folder, "jacobi"):
        found.setdefault(courant, {})["lumped" if "lumped" in name else "consistent"] = rest
    return sorted(found.items())


def jacobi(folder):
    rows = [[f"{courant:.3g}", *at.get("lumped", ["-"] * 3), *at.get("consistent", ["-"] * 3)]
            for courant, at in by_mass(folder)]
    return table(["C", "lumped: lambda_max", "plain", "damped", "consistent: lambda_max", "plain",
                  "damped"], rows)


def region(folder):
    """Up to which C plain Jacobi converges, in words."""
    text = []
    for mass in ("lumped", "consistent"):
        ends = [(courant, at[mass][1].isdigit(), at[mass][2].isdigit())
                for courant, at in by_mass(folder) if mass in at]
        if not ends:
            return "Not measured."
        plain = [courant for courant, reached, _ in ends if reached]
        damped = sum(reached for _, _, reached in ends)
        where = f"converges up to C = {max(plain):g}" if plain else "converges at no C"
        text.append(f"With {mass} mass plain Jacobi {where}; damped Jacobi converges at {damped} of "
                    f"{len(ends)}.")
    return "\n".join(text)


def paper(folder):
    """The paper's scenes at their own dt and at shorter ones."""
    found = {}
    for name, order, courant, *rest in jacobi_lines(folder, "paper"):
        scene, step = name.split("-", 1)
        found.setdefault(scene, (order, {}))[1][step] = (courant, *rest)
    shorter = ("C0.3", "C0.03", "lumped_C0.3", "lumped_C0.03")
    rows, reached = [], dict.fromkeys(("own", *shorter), 0)
    for scene, (order, at) in found.items():
        own, largest, plain, damped = at["own"]
        rows.append([scene, order, f"{own:.3g}", largest, plain, damped] +
                    [f"{at[step][1]} / {at[step][2]}" for step in shorter])
        for step in reached:
            reached[step] += at[step][2].isdigit()
    rows.append(["plain converges in", "", "", "", str(reached["own"]), ""] +
                [str(reached[step]) for step in shorter])
    return table(["scene", "unknowns", "its C", "lambda_max", "plain", "damped", "C = 0.3", "C = 0.03",
                  "lumped, C = 0.3", "lumped, C = 0.03"], rows) if found else "Not measured."


def count_and_time(cell):
    return f"{cell.iterations} / {short(cell.ms)}" if cell else "-"


def iterations(tolerance):
    def make(folder):
        rows = [place(g) + [count_and_time(g.get(m)) for m in OURS]
                for g in groups(folder, "peers_*") if g.tolerance == tolerance]
        return table(["system", "unknowns", "C", *OURS], rows)
    return make


def family(folder):
    methods = ("jacobi-cover", "jacobi-cluster", "sor", "gauss-seidel")
    rows = [place(g) + [g.tolerance] + [count_and_time(g.get(m)) for m in methods]
            for g in groups(folder, "family")]
    return table(["system", "unknowns", "C", "tolerance", *methods], rows)


def contacts(name, title):
    def make(folder):
        methods = ("auto", "pcg-cover", "pcg-cluster", "pcg-body")
        found = groups(folder, name)
        found.sort(key=lambda g: (g.courant, float(g.system.split("_")[1]), g.tolerance))
        rows = [[g.system.split("_")[1], str(g.order), str(g.contacts), str(g.closed),
                 f"{g.courant:.3g}", g.tolerance] + [count_and_time(g.get(m)) for m in methods]
                for g in found]
        return table([title, "unknowns", "contacts", "closed", "C", "tolerance", *methods], rows)
    return make


def sums(folder):
    rows = []
    for line in lines(folder, "sums"):
        _, _, order, n_thread, fixed, plain, iteration = line.split("\t")
        cost = 2 * (float(fixed) - float(plain)) / float(iteration)
        rows.append([order, n_thread, fixed, plain, iteration, f"{100 * cost:.1f} %"])
    return table(["unknowns", "threads", "sum in fixed chunks us", "plain sum us",
                  "pcg iteration us", "cost of two sums"], rows)


def fused(folder):
    rows = []
    for line in lines(folder, "fused"):
        _, _, order, apart, together = line.split("\t")
        cost = float(apart) / float(together) - 1
        rows.append([order, apart, together, f"{100 * cost:.1f} %"])
    return table(["unknowns", "factor us", "with multiply-add fused us", "cost of separate ones"],
                 rows)


def mixed(folder):
    methods = ("pcg-cover", "pcg-cluster", "pcg-body", "chebyshev-cluster")
    rows = []
    for g in groups(folder, "peers_*"):
        row = place(g) + [g.tolerance]
        for method in methods:
            row.append(ratio(g.get(method), g.get(method + "-mixed")))
        if any(cell != "-" for cell in row[4:]):
            rows.append(row)
    return table(["system", "unknowns", "C", "tolerance", *methods], rows)


def whole_runs(folder):
    """(scene, choices: name -> seconds, of solves, steps, solves, what was taken last; the best)."""
    found = {}
    for line in lines(folder, "runs"):
        _, scene, _, choice, wall, solve, steps, solves, _, why = line.split("\t")
        if wall != "-":
            name = scene.split("/")[-2]
            found.setdefault(name, {})[choice] = (float(wall), float(solve), steps, solves, why)
    for scene, choices in found.items():
        fixed = [name for name in choices if not name.startswith("auto")]
        if fixed and "auto" in choices and "auto-coupled" in choices:
            yield scene, choices, min(fixed, key=lambda name: choices[name][0])


def runs(folder):
    rows = []
    for scene, choices, best in whole_runs(folder):
        auto, coupled, fastest = choices["auto"], choices["auto-coupled"], choices[best][0]
        solves = min(at[1] for name, at in choices.items() if not name.startswith("auto"))
        rows.append([scene, auto[2], auto[3], short(1e3 * auto[0]), short(1e3 * auto[1]), auto[4], best,
                     bold_above(auto[0] / fastest), bold_above(auto[1] / solves),
                     coupled[3], short(1e3 * coupled[0]), bold_above(coupled[0] / fastest)])
    return table(["scene", "steps", "solves", "auto ms", "of it solves ms", "last took",
                  "best fixed choice", "auto over best, run", "auto over best, solves",
                  "solves with friction coupled", "auto ms", "over best, run"], rows)


def runs_verdict(folder):
    """How often auto stays within its goal, in words."""
    found = list(whole_runs(folder))
    if not found:
        return "Not measured."
    text = []
    for how, name in (("As it runs, with friction coupled", "auto-coupled"),
                      ("With the same symmetric systems for all", "auto")):
        parts = [(round(at[name][0] / at[best][0], 2), scene) for scene, at, best in found]
        above = [scene for part, scene in parts if part > AUTO_MAY_LOSE]
        worst = max(parts)
        text.append(f"{how}, auto takes at most {AUTO_MAY_LOSE} times as long as the best fixed choice in "
                    f"{len(parts) - len(above)} of {len(parts)} scenes; most in {worst[1]}, "
                    f"{worst[0]:.2f}" + (f"; above: {', '.join(above)}." if above else "."))
    return "\n".join(text)


TABLES = {
    "machine": machine, "verdict": verdict,
    "peers 1e-6": against_peers("1e-06"), "peers 1e-10": against_peers("1e-10"),
    "all 1e-6": all_peers("1e-06"), "all 1e-10": all_peers("1e-10"),
    "threads verdict": threads_verdict, "bandwidth verdict": bandwidth_verdict,
    "threads": threads, "scaling": scaling, "bandwidth": bandwidth, "jacobi": jacobi,
    "iterations 1e-6": iterations("1e-06"), "iterations 1e-10": iterations("1e-10"),
    "family": family, "contacts": contacts("contacts", "spacing of joints"),
    "penalty": contacts("penalty", "penalty"), "sums": sums, "fused": fused, "mixed": mixed,
    "runs": runs, "runs verdict": runs_verdict, "region": region, "paper": paper,
}


def write(folder, path):
    """Replace each table in the file for which there are results."""
    with open(path, encoding="utf-8") as file:
        text = file.read()
    for name, make in TABLES.items():
        made = make(folder)
        if made == "Not measured.":
            continue
        begin = f"<!-- bench: {name} -->"
        pattern = re.compile(re.escape(begin) + r"\n.*?<!-- end -->", re.DOTALL)
        if not pattern.search(text):
            raise SystemExit(f"error: {path} has no line {begin}")
        text = pattern.sub(lambda _: f"{begin}\n{made}\n<!-- end -->", text)
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)
