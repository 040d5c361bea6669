#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""The verification book, docs/verification.md.

Usage: book.py write SOURCE NMM FOLDER NAME...
       book.py pictures SOURCE NMM [SCENE]...
       book.py check SOURCE

write     runs the programs FOLDER/verify_NAME with the argument `all` and fills the section NAME of the
          document, between `<!-- begin NAME -->` and `<!-- end NAME -->`: for each scene its title,
          what its head comment says, its picture, and the rows that were printed. A section that is
          not there yet is added at the end. The overview of all cases goes to the section `overview`.
          Rows that fail stay in the book. Pictures are made as well, where NMM can draw.
pictures  runs the scenes of PICTURES and draws them into docs/pictures.
check     every scene of examples/verification is in the book and has a picture that is small, and
          every case a rate or the reason why it has none.

Programs and pictures share the processors.
"""

import concurrent.futures
import os
import re
import subprocess
import sys
import tempfile

HEAD = "| quantity | expected | measured | error | tolerance | |\n|---|---|---|---|---|---|\n"
SCENES = "examples/verification"
FAILED = "**fails**"
LARGEST = 40000  # bytes of a picture
WIDTH = "500"  # pixels

# Sections in which no error falls with mesh, step or penalty, but for the rates that they print.
NO_RATE = {
    "equilibrium": "forces balance to analysis.tolerance; the mesh's rates stand under Elastostatics",
    "orders": "exact, or one mesh",
    "slivers": "bounds that hold for all slivers",
    "threads": "equal bits or not",
}

# Scene, how it is run, how it is drawn: each shows what its case is about.
PICTURES = {
    "bar": (["time.end=0.012"], ["--field", "sxx"]),
    "bar_frequency": (["time.end=0.032"], ["--field", "sxx", "--scale", "200"]),
    "bars": (["time.end=0.012"], ["--field", "sxx"]),
    "base_motion": (["time.end=0.75"], ["--field", "displacement"]),
    "brazilian": (["covers.size=0.06"], ["--field", "sxx"]),
    "cantilever": ([], ["--field", "sxx"]),
    "cantilever_frequency": (["time.end=0.5"], ["--field", "sxx", "--scale", "50"]),
    "column": ([], ["--width", "300", "--field", "syy", "--scale", "500"]),
    "column_confined": ([], ["--width", "300", "--field", "syy", "--scale", "500"]),
    "column_initial_stress": ([], ["--width", "300", "--field", "syy"]),
    "cutting": (["joints[1]={polyline: [[0.01, -1], [-0.02, 1]]}"], ["--width", "400", "--field", "block"]),
    "drop": (["time.end=0.15"], ["--field", "velocity"]),
    "fall": ([], ["--width", "400", "--field", "velocity"]),
    "gauge": (["analysis.kind=static"], ["--width", "400", "--field", "sxx", "--scale", "100"]),
    "goodman_bray": (["interfaces.joint.friction_angle=33"], ["--field", "displacement"]),
    "hertz": ([], ["--field", "syy"]),
    "hinged_beam": (["interfaces.contact.friction_angle=18"], ["--field", "displacement"]),
    "incline": ([], ["--field", "displacement"]),
    "incline_turned": ([], ["--field", "displacement"]),
    "kirsch": (["covers.size=0.3"], ["--field", "sxx"]),
    "lame": ([], ["--field", "syy"]),
    "orders": ([], ["--field", "block"]),
    "oscillator": (["time.end=0.00314"], ["--width", "400", "--field", "stress", "--scale", "50"]),
    "p_wave": (["time.end=0.035"], ["--field", "sxx"]),
    "patch": ([], ["--width", "400", "--field", "block"]),
    "patch_contact": ([], ["--field", "syy"]),
    "patch_joint": ([], ["--field", "syy"]),
    "plate": ([], ["--width", "400", "--field", "block"]),
    "polygon": ([], ["--width", "400", "--field", "block"]),
    "projectile": ([], ["--width", "400", "--field", "displacement"]),
    "push": ([], ["--field", "displacement"]),
    "rotation": (["time.end=0.7853981634"], ["--field", "velocity"]),
    "s_wave": (["time.end=0.04"], ["--field", "sxy", "--scale", "1000"]),
    "shear": ([], ["--field", "sxy", "--scale", "200"]),
    "slivers": ([], ["--field", "block"]),
    "slope": ([], ["--width", "400", "--field", "displacement"]),
    "slowing": ([], ["--field", "displacement"]),
    "stack": ([], ["--field", "syy"]),
    "strength_reduction": (["interfaces.contact.friction_angle=19.9"], ["--field", "displacement"]),
    "strip": (["covers.size=0.5"], ["--field", "syy"]),
    "tension": ([], ["--field", "displacement", "--scale", "2000"]),
    "toppling": (["time.end=1.6"], ["--field", "displacement"]),
    "toppling_limit": (["time.end=3"], ["--field", "displacement"]),
}


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


# --- Scenes


def scenes_of(source):
    return sorted(n for n in os.listdir(os.path.join(source, SCENES)) if n.endswith(".yaml"))


def title_of(source, scene):
    return re.search(r"^title: (.*)$", read(os.path.join(source, SCENES, scene)), re.MULTILINE)[1]


def words_of(source, scene):
    """The comment at the head of a scene, without the licence."""
    lines = []
    for line in read(os.path.join(source, SCENES, scene)).split("\n"):
        if not line.startswith("#"):
            break
        if "SPDX" not in line:
            lines.append(line.lstrip("# "))
    return lines


# --- Cases


class Case:
    """What one program printed about one scene."""

    def __init__(self, section, scene):
        self.section, self.scene, self.rows = section, scene, []

    def tested(self):
        return [row for row in self.rows if row.rstrip().endswith(("| ok |", FAILED + " |"))]

    def failed(self):
        return [row for row in self.rows if FAILED in row]

    def worst(self):
        """Largest error over its tolerance, of the rows that have one."""
        worst = 0.0
        for row in self.tested():
            cells = [cell.strip() for cell in row.split("|")]
            if cells[5] and float(cells[5]) > 0:
                worst = max(worst, abs(float(cells[4])) / float(cells[5]))
        return worst


    def rate(self):
        """Rates with those expected, or why there is none; empty: neither."""
        found = []
        for row in self.rows:
            cells = [cell.strip() for cell in row.split("|")]
            if cells[1].startswith("no rate: "):
                found.append("-: " + cells[1][9:])
            elif re.search(r"\brate (of|in)\b", cells[1]) and "all sizes" not in cells[1]:
                found.append(f"{float(cells[3]):.2f}" + (f" ({float(cells[2]):.2g})" if cells[2] else ""))
        if not found and self.section in NO_RATE:
            found.append("-: " + NO_RATE[self.section])
        return ", ".join(dict.fromkeys(found))


def cases_of(section, program):
    """Cases in the order in which their scenes were first opened; whether the program went well."""
    done = subprocess.run([program, "all"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, check=False,
                          universal_newlines=True)
    cases, case = {}, None
    for line in done.stdout.split("\n"):
        if line.startswith("scene: "):
            case = cases.setdefault(line[7:], Case(section, line[7:]))
        elif line.startswith("| ") and case is not None:
            case.rows.append(line)
    return [c for c in cases.values() if c.rows], done.returncode


def text_of(source, case):
    picture = f"verification-{case.scene[:-5]}.png"
    lines = [f"### {title_of(source, case.scene)}", "",
             f"Scene: [{case.scene}](../{SCENES}/{case.scene})", "", "```text"]
    lines += words_of(source, case.scene) + ["```", ""]
    if os.path.exists(os.path.join(source, "docs/pictures", picture)):
        lines += [f"![{title_of(source, case.scene)}](pictures/{picture})", ""]
    return "\n".join(lines) + "\n" + HEAD + "\n".join(case.rows) + "\n\n"


def overview(source, cases):
    rows = sum(len(case.tested()) for case in cases)
    failed = sum(len(case.failed()) for case in cases)
    text = (f"{len(cases)} cases with {rows} tested numbers; {rows - failed} pass, {failed} fail.\n\n"
            "| case | section | scene | numbers | worst error / tolerance | rate (expected) | |\n"
            "|---|---|---|---|---|---|---|\n")
    for case in cases:
        verdict = f"**{len(case.failed())} fail**" if case.failed() else "passes"
        text += (f"| {title_of(source, case.scene)} | {case.section} | {case.scene} "
                 f"| {len(case.tested())} | {case.worst():.2g} | {case.rate()} | {verdict} |\n")
    return text


def fill(document, name, text):
    pattern = re.compile(rf"(<!-- begin {name} -->\n).*?(<!-- end {name} -->)", re.DOTALL)
    if not pattern.search(document):
        document += f"\n## {name.capitalize()}\n\n<!-- begin {name} -->\n<!-- end {name} -->\n"
    return pattern.sub(lambda found: found[1] + text + found[2], document)


# --- Commands


def picture_of(source, name):
    return os.path.join(source, "docs/pictures", f"verification-{name}.png")


def draw(source, nmm, name):
    """Run the scene and draw it; what went wrong, in words, or None."""
    settings, look = PICTURES[name]
    with tempfile.TemporaryDirectory() as folder:
        run = os.path.join(folder, name + ".vtkhdf")
        sets = [word for setting in settings for word in ("--set", setting)]
        width = [] if "--width" in look else ["--width", WIDTH]
        for line in ([nmm, "run", os.path.join(source, SCENES, name + ".yaml"), "-q", "--threads", "1", "-o", run]
                     + sets, [nmm, "plot", run, "-q", "-o", picture_of(source, name)] + width + look):
            done = subprocess.run(line, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False,
                                  universal_newlines=True)
            if done.returncode != 0:
                return f"no picture of {name}: {done.stdout.strip()}"
    return None


def write(source, nmm, folder, names):
    path = os.path.join(source, "docs/verification.md")
    document, everything = read(path), []
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        # The longest first: those that come late would run alone.
        programs = [(name, pool.submit(cases_of, name, os.path.join(folder, f"verify_{name}")))
                    for name in sorted(names, key=lambda name: name not in ("newmark", "sliding"))]
        drawn = [pool.submit(draw, source, nmm, name) for name in PICTURES]
        done = {name: program.result() for name, program in programs}
    for problem in filter(None, (picture.result() for picture in drawn)):
        print(problem)
    for name in names:
        cases, status = done[name]
        text = "\n" + "".join(text_of(source, case) for case in cases)
        if status != 0 and not any(case.failed() for case in cases):
            text += f"**The program of this section ended early, with status {status}.**\n\n"
        document = fill(document, name, text)
        everything += cases
        print(f"{name}: {len(cases)} cases, {sum(len(c.failed()) for c in cases)} rows fail", flush=True)
    document = fill(document, "overview", overview(source, everything))
    with open(path, "w", encoding="utf-8") as file:
        file.write(document)


def pictures(source, nmm, names):
    problems = [problem for problem in (draw(source, nmm, name) for name in names or PICTURES) if problem]
    sys.exit("\n".join(problems) or 0)


def check(source):
    document = read(os.path.join(source, "docs/verification.md"))
    bad = []
    for scene in scenes_of(source):
        picture = picture_of(source, scene[:-5])
        if f"({'../' + SCENES}/{scene})" not in document:
            bad.append(f"{scene} is not in the book")
        if scene[:-5] not in PICTURES or not os.path.exists(picture):
            bad.append(f"{scene} has no picture")
        elif os.path.getsize(picture) >= LARGEST:
            bad.append(f"the picture of {scene} has {os.path.getsize(picture)} bytes")
    table = re.search("<!-- begin overview -->.*<!-- end overview -->", document, re.DOTALL)[0]
    for row in re.findall(r"^\|.*\.yaml \|.*$", table, re.MULTILINE):
        cells = [cell.strip() for cell in row.split("|")]
        if not cells[6]:
            bad.append(f"{cells[3]} in {cells[2]} has no rate and no reason why")
    for line in bad:
        print(f"docs/verification.md:1: {line}")
    sys.exit(1 if bad else 0)


def main():
    command, source = sys.argv[1], sys.argv[2]
    if command == "write":
        write(source, sys.argv[3], sys.argv[4], sys.argv[5:])
    elif command == "pictures":
        pictures(source, sys.argv[3], sys.argv[4:])
    elif command == "check":
        check(source)
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
