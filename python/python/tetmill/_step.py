"""STEP files, converted to BREP by Gmsh's package, which contains OpenCASCADE."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager

from ._errors import InputError

_ENDINGS = (".step", ".stp")

#: OpenCASCADE's names of units of length, by the prefix of SI.
_SI = {None: "M", "KILO": "KM", "CENTI": "CM", "MILLI": "MM", "MICRO": "UM"}
#: The same for converted units, by their names.
_CONVERTED = {"INCH": "INCH", "FOOT": "FT", "MILE": "MI"}


def unit_of(text: str) -> str | None:
    """OpenCASCADE's name of the unit of length of a STEP file."""
    for statement in text.split(";"):
        if "LENGTH_UNIT" not in statement:
            continue
        converted = re.search(r"CONVERSION_BASED_UNIT\s*\(\s*'([A-Za-z]+)'", statement)
        if converted:
            return _CONVERTED.get(converted.group(1).upper())
        metre = re.search(r"SI_UNIT\s*\(\s*(?:\.(\w+)\.|\$)\s*,\s*\.METRE\.\s*\)", statement)
        if metre:
            return _SI.get(metre.group(1))
    return None


def _convert(path: str, result: str) -> None:
    """Writes a STEP file as BREP, in its own unit of length.

    Raises:
        InputError: There is no package gmsh, or OpenCASCADE cannot read the file.
    """
    try:
        import gmsh
    except ImportError:
        raise InputError(
            f"{path} is a STEP file, which needs OpenCASCADE",
            hint="install the package gmsh (pip install gmsh), or give a .brep file",
            file=path,
        ) from None
    with open(path, encoding="latin-1") as file:
        unit = unit_of(file.read())
    was_ready = bool(gmsh.isInitialized())
    if not was_ready:
        gmsh.initialize(interruptible=False)
    current = gmsh.model.getCurrent()
    loud = gmsh.option.getNumber("General.Terminal")
    before = gmsh.option.getString("Geometry.OCCTargetUnit")
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setString("Geometry.OCCTargetUnit", unit or "MM")
        gmsh.model.add("tetmill")
        gmsh.model.occ.importShapes(path)
        gmsh.model.occ.synchronize()
        gmsh.write(result)
    except Exception as error:  # Gmsh raises nothing else.
        raise InputError(f"{path} cannot be read by OpenCASCADE: {error}", file=path) from error
    finally:
        gmsh.model.remove()
        gmsh.option.setNumber("General.Terminal", loud)
        gmsh.option.setString("Geometry.OCCTargetUnit", before)
        if was_ready:
            gmsh.model.setCurrent(current)
        else:
            gmsh.finalize()


@contextmanager
def converted(paths: list[str]) -> Iterator[list[str]]:
    """The paths, with STEP files replaced by BREP files of the same name that exist within."""
    if not any(path.lower().endswith(_ENDINGS) for path in paths):
        yield paths
        return
    with tempfile.TemporaryDirectory() as folder:

        def replaced(path: str) -> str:
            if not path.lower().endswith(_ENDINGS) or not os.path.exists(path):
                return path
            result = os.path.join(folder, os.path.splitext(os.path.basename(path))[0] + ".brep")
            _convert(path, result)
            return result

        yield [replaced(path) for path in paths]
