"""Prints the names that VTK finds in an HDF5 file of tetmill: number of tets and their volume; `#number` without a name.
The file has no triangles for VTK, so boundaries have the numbers of their names only."""

import json
import sys

from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkFiltersVerdict import vtkCellSizeFilter
from vtkmodules.vtkIOHDF import vtkHDFReader

reader = vtkHDFReader()
assert reader.CanReadFile(sys.argv[1])
reader.SetFileName(sys.argv[1])
sizes = vtkCellSizeFilter()
sizes.SetInputConnection(reader.GetOutputPort())
sizes.Update()
grid = sizes.GetOutput()
array = lambda name: vtk_to_numpy(grid.GetCellData().GetArray(name))
volumes, bodies = array("Volume"), array("BodyId")
ids = vtk_to_numpy(reader.GetOutputDataObject(0).GetPointData().GetGlobalIds())
assert sorted(ids) == list(range(grid.GetNumberOfPoints()))
fields = reader.GetOutputDataObject(0).GetFieldData()
names = {fields.GetArrayName(k): vtk_to_numpy(fields.GetArray(k)) for k in range(fields.GetNumberOfArrays())}

found = {"boundaries": {}, "bodies": {}}
for name, numbers in names.items():
    if name.startswith("Boundary "):
        found["boundaries"][name.removeprefix("Boundary ")] = [len(numbers), 0.0]
named = {number for name, numbers in names.items() if name.startswith("Body ") for number in numbers}
groups = [(name.removeprefix("Body "), numbers) for name, numbers in names.items() if name.startswith("Body ")]
groups += [(f"#{number}", [number]) for number in set(bodies) - named]
for name, numbers in groups:
    of = sum(bodies == number for number in numbers) > 0
    found["bodies"][name] = [int(of.sum()), float(volumes[of].sum())]
print(json.dumps(found))
