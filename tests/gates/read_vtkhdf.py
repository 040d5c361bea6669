# SPDX-License-Identifier: MIT
"""Does VTK read a run file as it is meant? Every step of the blocks and of the contacts, read with
vtkHDFReader, must equal what h5py reads by the layout of docs/output.md.

    python3 read_vtkhdf.py RUN.vtkhdf

Needs VTK 9.3 or later, numpy and h5py (Debian 13: python3-vtk9 python3-h5py). Older readers know no
steps.
"""

import sys

import h5py
import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkVersion
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFReader

n_wrong = 0


def same(what, found, expected):
    global n_wrong
    if not numpy.array_equal(numpy.asarray(found), numpy.asarray(expected)):
        print(f"WRONG {what}: {found}, expected {expected}")
        n_wrong += 1


def open_reader(path):
    """A reader, and the times that it announces."""
    reader = vtkHDFReader()
    reader.SetFileName(path)
    reader.UpdateInformation()
    times = reader.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS())
    return reader, times


def read_step(reader, time):
    """Points, cells as (offsets, corners), and arrays of one time."""
    reader.UpdateTimeStep(time)
    data = reader.GetOutputDataObject(0)
    if not data.IsA("vtkDataSet"):  # later readers give parts
        data = data.GetPartition(0)
    arrays = {}
    for side in data.GetPointData(), data.GetCellData():
        for i in range(side.GetNumberOfArrays()):
            arrays[side.GetArrayName(i)] = vtk_to_numpy(side.GetArray(i))
    cells = data.GetCells() if data.IsA("vtkUnstructuredGrid") else data.GetVerts()
    return (vtk_to_numpy(data.GetPoints().GetData()), vtk_to_numpy(cells.GetOffsetsArray()),
            vtk_to_numpy(cells.GetConnectivityArray()), arrays)


def rows_of(dataset, k, count, n_step):
    """Rows of step k; datasets without steps have one set of rows."""
    first = k * count if len(dataset) == n_step * count else 0
    return dataset[first:first + count]


def compare_blocks(path, grid):
    reader, times = open_reader(path)
    n_step, n_point, n_cell = len(times), len(grid["Points"]), len(grid["Types"])
    same("number of steps", reader.GetNumberOfSteps(), grid["Steps"].attrs["NSteps"])
    same("times", times, grid["Steps/Values"][:])
    n_array, moved = 0, 0
    for k, time in enumerate(times):
        points, offsets, corners, arrays = read_step(reader, time)
        same(f"points at {time}", points, grid["Points"][:])
        same(f"offsets at {time}", offsets, grid["Offsets"][:])
        same(f"corners at {time}", corners, grid["Connectivity"][:])
        for side, count in ("PointData", n_point), ("CellData", n_cell):
            for name in grid[side]:
                expected = rows_of(grid[side][name], k, count, n_step)
                same(f"{name} at {time}", arrays.get(name), expected)
                n_array += 1
        moved = max(moved, abs(arrays["displacement"]).max())
    print(f"blocks: {n_step} steps from {times[0]:g} s to {times[-1]:g} s, {n_point} points, "
          f"{n_cell} cells, {n_array} arrays; largest displacement {moved:.4g} m, largest stress "
          f"{abs(arrays['stress']).max():.4g} Pa in the last step")
    return n_step > 1 and moved > 0


def compare_contacts(path, grid):
    reader, times = open_reader(path)
    same("times of contacts", times, grid["Steps/Values"][:])
    counts = []
    for k, time in enumerate(times):
        points, _, corners, arrays = read_step(reader, time)
        first, count = grid["Steps/PointOffsets"][k], grid["NumberOfPoints"][k]
        same(f"contact points at {time}", points, grid["Points"][first:first + count])
        same(f"contact cells at {time}", corners, numpy.arange(count))
        for name, values in grid["PointData"].items():
            same(f"{name} at {time}", arrays.get(name), values[first:first + count])
        counts.append(int(count))
    print(f"contacts: {len(times)} steps of {min(counts)} to {max(counts)} contacts")


def main(path):
    print(f"VTK {vtkVersion.GetVTKVersion()}, h5py {h5py.__version__}")
    with h5py.File(path, "r") as run:
        moves = compare_blocks(path, run["VTKHDF"])
        if "contacts" in run:
            compare_contacts(path.removesuffix(".vtkhdf") + ".contacts.vtkhdf", run["contacts"])
    print("nothing moves: a run with several frames is needed" if not moves else
          f"{n_wrong} wrong")
    return n_wrong > 0 or not moves


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
