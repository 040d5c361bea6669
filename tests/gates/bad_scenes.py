#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Every wrong scene of the corpus ends the command line with status 3, and tells each mistake with
file, line and column.

    bad_scenes.py PROGRAM FOLDER

FOLDER holds the scenes and index.txt, a line for each mistake: file line:column words.
"""

import collections
import os
import re
import subprocess
import sys
import tempfile


def read_index(folder):
    """Mistakes of each file as (line:column, words), in order."""
    mistakes = collections.defaultdict(list)
    with open(os.path.join(folder, "index.txt"), encoding="utf-8") as file:
        for line in file:
            if not line.startswith("#"):
                name, place, words = line.rstrip("\n").split(" ", 2)
                mistakes[name].append((place, words))
    return mistakes


def faults(command, scene, mistakes):
    """What is wrong with the way one file is refused."""
    done = subprocess.run([*command, scene, "--json"], capture_output=True, check=False)
    told = re.findall(rf"^{re.escape(scene)}:(\d+:\d+): error: (.*)$",
                      done.stderr.decode("utf-8", "replace"), re.M)
    if done.returncode != 3:
        yield f"exit status {done.returncode}"
    if done.stdout:
        yield "it prints a result"
    if len(told) != len(mistakes):
        yield f"{len(told)} mistakes, expected {len(mistakes)}"
    for (place, words), (expected_place, expected_words) in zip(told, mistakes):
        if place != expected_place or expected_words not in words:
            yield f"{place}: {words}, expected {expected_place}: {expected_words}"


def main(program, folder):
    scenes = sorted(name for name in os.listdir(folder) if name.endswith(".yaml"))
    mistakes = read_index(folder)
    n_failed = 0
    with tempfile.TemporaryDirectory() as output:
        for command in ["check"], ["run", "-o", os.path.join(output, "run.vtkhdf")]:
            for name in scenes:
                scene = os.path.join(folder, name)
                for fault in faults([program, *command], scene, mistakes[name]):
                    print(f"FAILED {command[0]} {name}: {fault}")
                    n_failed += 1
        written = os.listdir(output)
    print(f"{len(scenes)} scenes, {n_failed} failed; files written: {written}")
    sys.exit(not scenes or n_failed > 0 or len(written) > 0)


if __name__ == "__main__":
    main(*sys.argv[1:])
