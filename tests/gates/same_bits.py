#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""One scene gives the same bits for any number of threads, and on a device.

    same_bits.py threads PROGRAM SCENE...
    same_bits.py fine PROGRAM SCENE=SIZE...
    same_bits.py eventful PROGRAM SCENE=SIZE...
    same_bits.py device PROGRAM SOURCE BUILD REASON SCENE...

The whole results of `nmm run --json` are compared, numbers and state hash, but for places and times.

threads: the first millisecond with 1, 2 and 3 threads.
fine: the same for three short steps with covers so small that every loop is shared among threads
(loops below some thousand turns are not); tells races when PROGRAM has a thread sanitizer.
eventful: the same to 0.04 s in steps so long that some are cut, where contacts open and slide; for
release builds.
device: the preset fake-device is configured in BUILD and its program built. Its runs with
--device target (which must say that they were on a device) and --device host must equal those of
PROGRAM, which another compiler built. REASON: why there is no such device here, for exit status 77;
empty where it is.
"""

import json
import os
import subprocess
import sys
import tempfile

SHORT = ["--set", "time.dt=1e-4", "--set", "time.end=1e-3"]
SHORTER = ["--set", "time.dt=1e-5", "--set", "time.end=3e-5"]
LONG_STEPS = ["--set", "time.dt=0.04", "--set", "time.end=0.04", "--set", "output.every=0"]
SHARED = {"elements": 4097, "covers": 4097, "contacts": 2049}  # from here on loops are shared
# Method, blocks, precision: what a device does as the host does it (docs/offload.md).
SAME_ON_DEVICE = ("pcg cover double", "pcg cluster double", "pcg cluster mixed", "jacobi auto double",
                  "chebyshev auto mixed")
PLACES_AND_TIMES = ("output", "wall_seconds", "phase_seconds")

n_failed = 0


def run(program, scene, *words, look=None):
    """Result of `nmm run` without places and times; the solver apart from where it ran. `look` is
    called with the run file."""
    # Threads that spin would wait for one another where cores are shared.
    environment = {**os.environ, "OMP_WAIT_POLICY": "passive"}
    with tempfile.TemporaryDirectory() as folder:
        command = [program, "run", scene, "--json", "-q", "-o", os.path.join(folder, "run.vtkhdf")]
        done = subprocess.run(command + list(words), env=environment, text=True,
                              capture_output=True, check=False)
        if done.returncode == 0 and look:
            look(command[-1])
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)}: exit status {done.returncode}\n{done.stderr}")
    result = json.loads(done.stdout)
    for name in PLACES_AND_TIMES:
        del result[name]
    place = result["solver"].pop("device"), result["solver"].pop("on_device")
    del result["solver"]["threads"]  # used, which learned paces decide
    copied = [result["solver"].pop("transfer" + name) for name in ("s", "_bytes", "_seconds")]
    for amount in copied[:2]:
        if (amount > 0) != place[1]:
            sys.exit(f"{' '.join(command)}: transfers {copied}, on a device: {place[1]}")
    return result, place


def compare(what, result, expected):
    global n_failed
    differing = [name for name in expected if result.get(name) != expected[name]]
    n_failed += len(differing) > 0
    print(f"{'FAILED' if differing else 'ok    '} {what}: {result['state_hash']}")
    for name in differing:
        print(f"       {name}: {result.get(name)}, expected {expected[name]}")


def head(scene, result):
    print(f"{os.path.relpath(scene)}: {result['unknowns']} unknowns, {result['contacts']} contacts, "
          f"{result['steps']} steps, {result['solver']['method']}")


def compare_threads(program, scene, *words, look=None):
    expected, _ = run(program, scene, "--threads", "1", *words, look=look)
    head(scene, expected)
    for n_thread in "2", "3":
        result, _ = run(program, scene, "--threads", n_thread, *words)
        compare(f"{n_thread} threads", result, expected)
    return expected


def threads(program, *scenes):
    for scene in scenes:
        compare_threads(program, scene, *SHORT)


def fine(program, *scenes):
    global n_failed
    for scene, size in (words.split("=") for words in scenes):
        result = compare_threads(program, scene, *SHORTER, "--set", f"covers.size={size}")
        for name, least in SHARED.items():
            if result[name] < least:
                print(f"FAILED only {result[name]} {name}, {least} needed")
                n_failed += 1


def count_events(path):
    """Contacts that were closed in a frame and open in the next one, and that slide, over a run."""
    import h5py
    n_opened = n_sliding = 0
    closed = set()
    with h5py.File(path, "r") as file:
        group = file["contacts"]
        data = {name: group["PointData"][name][:] for name in ("vertex", "edge", "mode")}
        for first, n in zip(group["Steps/PointOffsets"][:], group["NumberOfPoints"][:]):
            part = slice(int(first), int(first) + int(n))
            rows = list(zip(*(data[name][part].tolist() for name in ("vertex", "edge", "mode"))))
            n_opened += sum(mode == 0 and (v, e) in closed for v, e, mode in rows)
            n_sliding += sum(mode == 1 for _, _, mode in rows)
            closed = {(v, e) for v, e, mode in rows if mode != 0}
    return n_opened, n_sliding


def eventful(program, *scenes):
    global n_failed
    for scene, size in (words.split("=") for words in scenes):
        seen = []
        result = compare_threads(program, scene, *LONG_STEPS, "--set", f"covers.size={size}",
                                 look=lambda path: seen.append(count_events(path)))
        events = {"dt_cuts": result["dt_cuts"], "opened": seen[0][0], "sliding": seen[0][1]}
        print(f"       {events}")
        for name, least in {**SHARED, **dict.fromkeys(events, 1)}.items():
            if {**result, **events}[name] < least:
                print(f"FAILED only {({**result, **events})[name]} {name}, {least} needed")
                n_failed += 1


def build_device_program(source, build):
    cmake = os.environ.get("CMAKE", "cmake")
    for words in (["--preset", "fake-device", "-B", build], ["--build", build, "--target", "nmm"]):
        subprocess.run([cmake, *words], cwd=source, check=True, stdout=subprocess.DEVNULL)
    return os.path.join(build, "nmm")


def device(program, source, build, reason, *scenes):
    global n_failed
    if reason:
        print(f"skipped: {reason}")
        sys.exit(77)
    device_program = build_device_program(source, build)
    for scene in scenes:
        for solver in SAME_ON_DEVICE:
            choice = list(SHORT)
            for name, word in zip(("method", "blocks", "precision"), solver.split()):
                choice += ["--set", f"solver.{name}={word}"]
            expected, _ = run(program, scene, "--device", "host", "--threads", "1", *choice)
            head(scene, expected)
            print(f"       {solver}")
            for where in "target", "host":
                result, place = run(device_program, scene, "--device", where, *choice)
                compare(f"{place[0]}, on a device: {place[1]}", result, expected)
                if place != (where, where == "target"):
                    print(f"FAILED asked for {where}")
                    n_failed += 1


if __name__ == "__main__":
    {"threads": threads, "fine": fine, "eventful": eventful, "device": device}[sys.argv[1]](*sys.argv[2:])
    print(f"{n_failed} failed")
    sys.exit(n_failed > 0)
