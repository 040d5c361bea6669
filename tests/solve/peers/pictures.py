# SPDX-License-Identifier: MIT
"""The pictures of docs/solvers.md, as small SVG files that do not change without the numbers."""

import os

from results import groups, is_rock, lines

import matplotlib

matplotlib.use("svg")
matplotlib.rcParams.update({"svg.hashsalt": "nmm", "svg.fonttype": "none", "font.size": 9,
                            "axes.grid": True, "grid.alpha": 0.3, "lines.markersize": 4})
import matplotlib.pyplot as pyplot  # noqa: E402  (after the choice of output)


def title(courant):
    return "C = 1e5" if courant == 1e5 else f"C = {courant:g}"


def save(figure, folder, name):
    os.makedirs(folder, exist_ok=True)
    for frame in figure.axes:
        frame.minorticks_off()
    figure.tight_layout()
    figure.savefig(os.path.join(folder, name), metadata={"Date": None, "Creator": None})
    pyplot.close(figure)


def peers(results, folder):
    """Time of a solve over the number of unknowns, one frame for each Courant number."""
    found = [g for g in groups(results, "peers_*") if is_rock(g) and g.tolerance == "1e-06"]
    courants = sorted({round(g.courant, 9 if g.courant < 1 else 0) for g in found})
    if not found:
        return
    figure, frames = pyplot.subplots(1, len(courants), figsize=(3 * len(courants), 3),
                                     sharey=True, squeeze=False)
    for frame, courant in zip(frames[0], courants):
        here = [g for g in found if abs(g.courant / courant - 1) < 0.1]
        for label, pick, style in (("auto", lambda g: g.get("auto"), "o-"),
                                   ("best iterative peer", lambda g: g.best("iterative"), "s--"),
                                   ("best direct peer", lambda g: g.best("direct"), "^:")):
            points = [(g.order, pick(g).ms) for g in here if pick(g)]
            if points:
                frame.loglog(*zip(*points), style, label=label)
        frame.set_title(title(courant))
        frame.set_xlabel("unknowns")
    frames[0][0].set_ylabel("ms a solve, one thread")
    frames[0][0].legend()
    save(figure, folder, "solvers-peers.svg")


def jacobi(results, folder):
    """Where Jacobi converges: largest eigenvalue of D^-1 A, and sweeps, over C."""
    found = {"lumped": [], "consistent": []}
    for line in lines(results, "jacobi"):
        _, path, _, courant, largest, plain, plain_end, damped, damped_end = line.split("\t")
        mass = "lumped" if "lumped" in path else "consistent"
        found[mass].append((float(courant), float(largest),
                            int(plain) if plain_end == "converged" else None,
                            int(damped) if damped_end == "converged" else None))
    if not found["lumped"]:
        return
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(8, 3))
    for mass, colour in (("lumped", "C0"), ("consistent", "C1")):
        rows = sorted(found[mass])
        left.semilogx([r[0] for r in rows], [r[1] for r in rows], "o-", color=colour, label=mass)
        for column, style, name in ((2, "s-", "plain"), (3, "o--", "damped")):
            points = [(r[0], r[column]) for r in rows if r[column]]
            if points:
                right.loglog(*zip(*points), style, color=colour, label=f"{mass}, {name}")
    left.axhline(2, color="black", linewidth=1)
    left.set_ylim(bottom=0)
    left.set_ylabel("lambda_max; plain Jacobi needs < 2")
    right.set_ylabel("sweeps to 1e-6")
    figure.suptitle("rock-1000, one step", fontsize=9)
    for frame in (left, right):
        frame.set_xlabel("C = c_p dt / h")
        frame.legend()
    save(figure, folder, "solvers-jacobi.svg")


def iterations(results, folder):
    """Iterations by kind of block over the number of unknowns, and those of two libraries."""
    found = [g for g in groups(results, "peers_*") if is_rock(g) and g.tolerance == "1e-06"]
    methods = ("pcg-cover", "pcg-cluster", "pcg-body", "petsc-cg-2x2", "petsc-gamg")
    if not found:
        return
    figure, frames = pyplot.subplots(1, 3, figsize=(9, 3), sharey=True)
    for frame, courant in zip(frames, (1, 10, 1e5)):
        here = [g for g in found if abs(g.courant / courant - 1) < 0.1]
        for method, style in zip(methods, ("o-", "s-", "^-", "x:", "+:")):
            points = [(g.order, g.get(method).iterations) for g in here if g.get(method)]
            if points:
                frame.loglog(*zip(*points), style, label=method)
        frame.set_title(title(courant))
        frame.set_xlabel("unknowns")
    frames[0].set_ylabel("iterations to 1e-6")
    frames[0].legend(fontsize=7)
    save(figure, folder, "solvers-iterations.svg")


def draw(results, folder):
    peers(results, folder)
    jacobi(results, folder)
    iterations(results, folder)
