#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""The verification book, docs/verification.md.

Usage: book.py write SOURCE FOLDER NAME...
       book.py pictures SOURCE NMM
       book.py check SOURCE

write     runs the programs FOLDER/verify_NAME with the argument `all` and fills the section NAME of the
          document, between `<!-- begin NAME -->` and `<!-- end NAME -->`: for each scene its title,
          what its head comment says, its picture where there is one, and the rows that were printed.
          The overview of all cases goes to the section `overview`. Rows that fail stay in the book.
pictures  runs the scenes of PICTURES and draws them into docs/pictures.
check     every scene of examples/verification is in the book, and every picture is small.
"""

import os
import re
import subprocess
import sys
import tempfile

import small_png

HEAD = "| quantity | expected | measured | error | tolerance | |\n|---|---|---|---|---|---|\n"
SCENES = "examples/verification"
FAILED = "**fails**"
LARGEST = 40000  # bytes of a picture

# Scene, how it is run, how it is drawn.
PICTURES = {
    "bars": (["time.end=0.012"], ["--field", "sxx"]),
    "brazilian": ([], ["--field", "sxx"]),
    "cantilever": ([], ["--field", "sxx"]),
    "goodman_bray": (["interfaces.joint.friction_angle=33"], ["--field", "displacement"]),
    "hertz": ([], ["--field", "syy"]),
    "hinged_beam": (["interfaces.contact.friction_angle=18"], ["--field", "displacement"]),
    "kirsch": ([], ["--field", "sxx"]),
    "lame": ([], ["--field", "syy"]),
    "p_wave": (["time.end=0.035"], ["--field", "sxx"]),
    "patch_contact": ([], ["--field", "syy"]),
    "stack": ([], ["--field", "syy"]),
    "strip": ([], ["--field", "syy"]),
    "toppling": (["time.end=1.6"], ["--field", "displacement"]),
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
            "| case | section | scene | numbers | worst error / tolerance | |\n|---|---|---|---|---|---|\n")
    for case in cases:
        verdict = f"**{len(case.failed())} fail**" if case.failed() else "passes"
        text += (f"| {title_of(source, case.scene)} | {case.section} | {case.scene} "
                 f"| {len(case.tested())} | {case.worst():.2g} | {verdict} |\n")
    return text


def fill(document, name, text):
    pattern = re.compile(rf"(<!-- begin {name} -->\n).*?(<!-- end {name} -->)", re.DOTALL)
    if not pattern.search(document):
        sys.exit(f"book.py: no section '{name}' in the document")
    return pattern.sub(lambda found: found[1] + text + found[2], document)


# --- Commands


def write(source, folder, names):
    path = os.path.join(source, "docs/verification.md")
    document, everything = read(path), []
    for name in names:
        cases, status = cases_of(name, os.path.join(folder, f"verify_{name}"))
        text = "\n" + "".join(text_of(source, case) for case in cases)
        if status != 0 and not any(case.failed() for case in cases):
            text += f"**The program of this section ended early, with status {status}.**\n\n"
        document = fill(document, name, text)
        everything += cases
        print(f"{name}: {len(cases)} cases, {sum(len(c.failed()) for c in cases)} rows fail", flush=True)
    document = fill(document, "overview", overview(source, everything))
    with open(path, "w", encoding="utf-8") as file:
        file.write(document)


def pictures(source, nmm):
    with tempfile.TemporaryDirectory() as folder:
        for name, (settings, look) in PICTURES.items():
            run = os.path.join(folder, name + ".vtkhdf")
            sets = [word for setting in settings for word in ("--set", setting)]
            subprocess.run([nmm, "run", os.path.join(source, SCENES, name + ".yaml"), "-q", "-o", run] + sets,
                           check=True)
            picture = os.path.join(source, "docs/pictures", f"verification-{name}.png")
            subprocess.run([nmm, "plot", run, "-q", "-o", picture, "--width", "600"] + look, check=True)
            small_png.shrink(picture, 256, LARGEST)


def check(source):
    document = read(os.path.join(source, "docs/verification.md"))
    bad = [f"{scene} is not in the book" for scene in scenes_of(source)
           if f"({'../' + SCENES}/{scene})" not in document]
    for name in PICTURES:
        picture = os.path.join(source, "docs/pictures", f"verification-{name}.png")
        if not os.path.exists(picture):
            bad.append(f"{name} has no picture")
        elif os.path.getsize(picture) >= LARGEST:
            bad.append(f"the picture of {name} has {os.path.getsize(picture)} bytes")
    for line in bad:
        print(f"docs/verification.md:1: {line}")
    sys.exit(1 if bad else 0)


def main():
    command, source = sys.argv[1], sys.argv[2]
    if command == "write":
        write(source, sys.argv[3], sys.argv[4:])
    elif command == "pictures":
        pictures(source, sys.argv[3])
    elif command == "check":
        check(source)
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
