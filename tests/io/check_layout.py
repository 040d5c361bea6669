# SPDX-License-Identifier: MIT
#
# The layout of a run file as other programs see it: names, shapes, types and offsets with h5py, the
# export with VTK's own readers, and whether both hold the same numbers.
#
#   check_layout.py PROGRAM      runs PROGRAM (write_fixture) in a folder of its own.
# Exit status 77: h5py is missing, nothing was checked.

import os
import subprocess
import sys
import tempfile

try:
    import h5py
    import numpy
except ImportError as error:
    print(f"skipped: {error}; Debian package python3-h5py")
    sys.exit(77)

N_POINT, N_ELEMENT, N_CORNER, N_EDGE = 15 + 9, 18, 3 * 16 + 9, 12 + 9
N_FRAME = 6


def check(holds, what):
    if not holds:
        sys.exit(f"wrong: {what}")


def check_dataset(group, name, shape, kind):
    check(name in group, f"{group.name}/{name} is missing")
    found = group[name]
    check(found.shape == shape, f"{found.name} has shape {found.shape}, expected {shape}")
    check(found.dtype == numpy.dtype(kind), f"{found.name} has type {found.dtype}, expected {kind}")


def check_grid(grid):
    check(list(grid.attrs["Version"]) == [2, 0], "Version")
    check(grid.attrs["Type"] == b"UnstructuredGrid", "Type")
    check(grid.attrs.get_id("Type").get_type().get_cset() == h5py.h5t.CSET_ASCII, "Type is ASCII")
    for name, value in (("Points", N_POINT), ("Cells", N_ELEMENT), ("ConnectivityIds", N_CORNER)):
        # Written once: one entry, whatever the number of steps.
        check_dataset(grid, "NumberOf" + name, (1,), "<i8")
        check(grid["NumberOf" + name][0] == value, "NumberOf" + name)
    check_dataset(grid, "Points", (N_POINT, 3), "<f8")
    check_dataset(grid, "Connectivity", (N_CORNER,), "<i8")
    check_dataset(grid, "Offsets", (N_ELEMENT + 1,), "<i8")
    check_dataset(grid, "Types", (N_ELEMENT,), "u1")
    check((grid["Types"][:] == 7).all(), "all cells are polygons")
    check_dataset(grid, "PointData/displacement", (N_FRAME * N_POINT, 3), "<f4")
    check_dataset(grid, "PointData/velocity", (N_FRAME * N_POINT, 3), "<f4")
    check_dataset(grid, "CellData/stress", (N_FRAME * N_ELEMENT, 6), "<f4")
    check_dataset(grid, "CellData/block_id", (N_ELEMENT,), "<i4")
    check_dataset(grid, "CellData/material", (N_ELEMENT,), "<i4")
    # One chunk for each frame and field, compressed.
    check(grid["PointData/displacement"].chunks == (N_POINT, 3), "chunk of displacement")
    check(grid["CellData/stress"].chunks == (N_ELEMENT, 6), "chunk of stress")
    check(grid["CellData/stress"].compression_opts == 1 and grid["CellData/stress"].shuffle, "gzip 1")
    check(grid["CellData/stress"].attrs["unit"] == b"Pa", "unit of stress")
    check(b"tension" in grid["CellData/stress"].attrs["meaning"], "meaning of stress")


def check_grid_steps(steps):
    check(steps.attrs["NSteps"] == N_FRAME, "NSteps")
    check_dataset(steps, "Values", (N_FRAME,), "<f8")
    check(numpy.allclose(steps["Values"][:], 0.02 * numpy.arange(N_FRAME)), "times")
    zero, one = numpy.zeros(N_FRAME), numpy.ones(N_FRAME)
    frame = numpy.arange(N_FRAME)
    for name, value in (("PartOffsets", zero), ("NumberOfParts", one), ("PointOffsets", zero),
                        ("PointDataOffsets/displacement", N_POINT * frame),
                        ("PointDataOffsets/velocity", N_POINT * frame),
                        ("CellDataOffsets/stress", N_ELEMENT * frame),
                        ("CellDataOffsets/block_id", zero), ("CellDataOffsets/material", zero)):
        check_dataset(steps, name, (N_FRAME,), "<i8")
        check((steps[name][:] == value).all(), name)
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        check_dataset(steps, name, (N_FRAME, 1), "<i8")
        check((steps[name][:] == 0).all(), name)


def check_contacts(contacts):
    steps = contacts["Steps"]
    check(contacts.attrs["Type"] == b"PolyData", "Type of contacts")
    check(steps.attrs["NSteps"] == N_FRAME, "NSteps of contacts")
    count = contacts["NumberOfPoints"][:]
    # Steps 0, 2, 4, 6, 8, 10 of the pattern 2, 0, 3; step 0 has none yet. None is one row.
    check(list(count) == [1, 3, 1, 2, 3, 1], f"contacts of the frames: {count}")
    check(list(steps["PartOffsets"][:]) == list(range(N_FRAME)), "PartOffsets of contacts")
    check((contacts["Vertices/NumberOfCells"][:] == count).all(), "one vertex cell a contact")
    before = numpy.concatenate(([0], numpy.cumsum(count)[:-1]))
    check((steps["CellOffsets"][:, 0] == before).all(), "CellOffsets of contacts")
    for k in range(N_FRAME):
        n = count[k]
        # As VTK reads them: each part has one offset more than cells.
        first = before[k] + k
        check((contacts["Vertices/Offsets"][first:first + n + 1] == numpy.arange(n + 1)).all(), "Offsets")
        first = steps["ConnectivityIdOffsets"][k, 0]
        check((contacts["Vertices/Connectivity"][first:first + n] == numpy.arange(n)).all(), "Connectivity")
        rows = slice(steps["PointOffsets"][k], steps["PointOffsets"][k] + n)
        mode = contacts["PointData/mode"][rows]
        check(list(mode) == (list(range(n)) if n > 1 else [-1]), f"modes {mode}")
        force = contacts["PointData/force"][rows]
        length = numpy.hypot(force[:, 0], force[:, 1])
        parts = numpy.hypot(contacts["PointData/normal_force"][rows], contacts["PointData/shear_force"][rows])
        check(numpy.allclose(length, parts, rtol=1e-5), "force from its parts")
    for name in ("Lines", "Polygons", "Strips"):
        check((contacts[name + "/NumberOfCells"][:] == 0).all(), name)
        check(contacts[name + "/Offsets"].shape == (N_FRAME,), name + "/Offsets")


def columns(table):
    """The columns of a table by name."""
    names = [name.decode() for name in table.attrs["columns"]]
    check(table.shape[1] == len(names) == len(table.attrs["unit"]) == len(table.attrs["meaning"]), table.name)
    return {name: table[:, k] for k, name in enumerate(names)}


def check_meta(meta):
    text = meta["scene"][()]
    check(b"title: Two blocks on a bench" in text, "scene text")
    value = 14695981039346656037
    for byte in text:
        value = (value ^ byte) * 1099511628211 % 2**64
    check(meta.attrs["scene_hash"].decode() == f"{value:016x}", "FNV hash of the scene")
    check(meta.attrs["status"] == b"completed", "status")
    for name in ("title", "version", "compiler", "build", "machine"):
        check(len(meta.attrs[name]) > 0, name)
    ledger = columns(meta["ledger"])
    check(list(ledger["step"]) == list(range(1, 11)), "ledger")
    check(numpy.allclose(ledger["kinetic"], 1.5 * numpy.arange(1, 11)), "kinetic energy")
    crest = columns(meta["monitors/crest"])
    check(len(crest) == 9 and len(crest["stress_yy"]) == 10, "monitor")
    check(numpy.allclose(crest["time"], 0.01 * numpy.arange(1, 11)), "times of the monitor")
    check(list(columns(meta["monitors/a_b"])) == ["step", "time", "displacement_x", "displacement_y"],
          "only what is recorded")
    check(meta["monitors/a_b"].attrs["name"] == b"a/b", "the monitor's own name")
    check(meta["summary"][()]["steps"] == 10 and meta["summary"][()]["method"] == b"pcg", "summary")
    check(meta["outline"].shape == (N_EDGE, 5), "outline")
    check(list(columns(meta["supports"])["held"]) == [0, 0, 0, 0, 0, 1], "supports")


def check_pointer(folder):
    with h5py.File(os.path.join(folder, "run.contacts.vtkhdf"), "r") as pointer:
        check(pointer["VTKHDF"].attrs["Type"] == b"PolyData", "pointer file")


def check_export(folder, run):
    try:
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkIOXML import vtkXMLPolyDataReader, vtkXMLUnstructuredGridReader
    except ImportError as error:
        print(f"export not checked: {error}; Debian package python3-vtk9")
        return
    grid, contacts = run["VTKHDF"], run["contacts"]
    for k in range(N_FRAME):
        reader = vtkXMLUnstructuredGridReader()
        reader.SetFileName(os.path.join(folder, "vtu", f"run_{k:05d}.vtu"))
        reader.Update()
        found = reader.GetOutput()
        check(found.GetNumberOfPoints() == N_POINT and found.GetNumberOfCells() == N_ELEMENT, "sizes")
        check(found.GetCell(N_ELEMENT - 1).GetNumberOfPoints() == 5, "the last cell is a pentagon")
        points = vtk_to_numpy(found.GetPoints().GetData())
        check((points == grid["Points"][:]).all(), "points of the export")
        for name, data, n in (("displacement", found.GetPointData(), N_POINT),
                              ("velocity", found.GetPointData(), N_POINT),
                              ("stress", found.GetCellData(), N_ELEMENT)):
            stored = grid["CellData/stress"] if name == "stress" else grid["PointData/" + name]
            check((vtk_to_numpy(data.GetArray(name)) == stored[k * n:(k + 1) * n]).all(), name)
        check((vtk_to_numpy(found.GetCellData().GetArray("block_id")) == grid["CellData/block_id"][:]).all(), "blocks")
        reader = vtkXMLPolyDataReader()
        reader.SetFileName(os.path.join(folder, "vtu", f"run_contacts_{k:05d}.vtp"))
        reader.Update()
        n = int(contacts["NumberOfPoints"][k])
        first = int(contacts["Steps/PointOffsets"][k])
        if n == 1:
            n = 0
        check(reader.GetOutput().GetNumberOfPoints() == n == reader.GetOutput().GetNumberOfVerts(), "contacts")
        if n > 0:
            force = vtk_to_numpy(reader.GetOutput().GetPointData().GetArray("force"))
            check((force == contacts["PointData/force"][first:first + n]).all(), "forces of the export")
    print("export checked with VTK")


def main():
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.argv[1], folder], check=True)
        with h5py.File(os.path.join(folder, "run.vtkhdf"), "r") as run:
            check_grid(run["VTKHDF"])
            check_grid_steps(run["VTKHDF/Steps"])
            check_contacts(run["contacts"])
            check_meta(run["nmm"])
            check_export(folder, run)
        check_pointer(folder)
        first = open(os.path.join(folder, "vtu", "run.pvd"), encoding="utf-8").read()
        check(first.count("<DataSet") == N_FRAME and 'timestep="0.02"' in first, "list of frames")
        leftover = [name for name in os.listdir(folder) if name.endswith((".part", ".lock"))]
        check(leftover == [], f"left behind: {leftover}")
    print("layout as documented")


main()
