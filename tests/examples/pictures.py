# SPDX-License-Identifier: MIT
"""Draws the pictures of the examples' pages anew, by the commands that the pages give.

    python3 pictures.py NMM [EXAMPLE]...        EXAMPLE: slope, paper/beam_18, ...; all without

Each picture keeps its width. `before.png`, where there is one, is the first frame with a colour for
each block.
"""

import glob
import os
import shlex
import struct
import subprocess
import sys
import tempfile

from pages import ROOT

EXAMPLES = os.path.join(ROOT, "examples")


def commands(readme):
    """The lines of the page that run and draw: (words of run, words of plot)."""
    with open(readme, encoding="utf-8") as file:
        lines = [line.strip() for line in file if line.startswith("nmm ")]
    return [next(shlex.split(line)[1:] for line in lines if line.startswith(f"nmm {word} "))
            for word in ("run", "plot")]


def width_of(picture):
    with open(picture, "rb") as file:
        return struct.unpack(">I", file.read(24)[16:20])[0]


def draw(program, name):
    folder = os.path.join(EXAMPLES, name)
    run, plot = commands(os.path.join(folder, "README.md"))
    run[1] = os.path.join(ROOT, run[1])
    picture, before = (os.path.join(folder, f"{word}.png") for word in ("picture", "before"))
    plot[plot.index("-o") + 1] = picture
    with tempfile.TemporaryDirectory() as work:
        def nmm(*words):
            subprocess.run([program, *words, "--quiet"], cwd=work, check=True)
        nmm(*run, "--threads", "1")
        nmm(*plot, "--width", str(width_of(picture)))
        if os.path.exists(before):
            nmm("plot", plot[1], "-o", before, "--frame", "0", "--field", "block", "--width",
                str(width_of(before)))
    print(name, flush=True)


if __name__ == "__main__":
    found = [os.path.relpath(os.path.dirname(p), EXAMPLES)
             for p in glob.glob(os.path.join(EXAMPLES, "**", "picture.png"), recursive=True)]
    for example in sys.argv[2:] or sorted(found):
        draw(os.path.abspath(sys.argv[1]), example)
