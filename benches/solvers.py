#!/usr/bin/env python3
"""Solves -Δu = 6 in the unit ball, u = 0 on its surface, with meshes of tetmill in several formats, and measures the error of u = 1 - r² in L².

  benches/solvers.py TETMILL [--elmer ELMERSOLVER_MPI] [--levels 3]

Each solver reads the boundary by its name or number from the file; a wrong boundary would give another solution. Needs numpy and scipy.
Runs those available of ngsolve, scikit-fem with meshio, PyMFEM (package mfem), and ElmerSolver_mpi (with its ELMER_HOME) under mpirun.
Prints a table: one line for each solver, format and number of parts, with the errors of the levels and their last ratio (expected: 4).
"""
import argparse
import glob
import os
import subprocess
import tempfile

import numpy as np

GEOMETRY = "algebraic3d\nsolid ball = sphere (0, 0, 0; 1) -bcname=skin;\ntlo ball -material=inside;\n"
# Five points, exact for polynomials of degree three, by barycentric coordinates.
POINTS = np.array([[1 / 4] * 4] + [[1 / 2 if i == k else 1 / 6 for i in range(4)] for k in range(4)])
WEIGHTS = np.array([-4 / 5] + [9 / 20] * 4)


def error(points, tets, values):
    """The L² norm of u_h - u over the tets, for u_h linear in each."""
    corners = points[tets]
    volumes = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6
    places = np.einsum("qk,tkx->tqx", POINTS, corners)
    off = np.einsum("qk,tk->tq", POINTS, values[tets]) - (1 - (places**2).sum(axis=2))
    return float(np.sqrt((volumes * np.einsum("q,tq->t", WEIGHTS, off**2)).sum()))


def generate(tetmill, folder, level, form, parts, *more):
    geometry = os.path.join(folder, "ball.geo")
    with open(geometry, "w") as file:
        file.write(GEOMETRY)
    out = os.path.join(folder, f"{form}-{parts}-{level}{''.join(more)}")
    command = [tetmill, "generate", geometry, "-o", out, "-n", str(parts), "--levels", str(level), "--preset", "coarse",
               "-f", form, "-q", *more]
    subprocess.run(command, check=True)
    return out


def solve(points, tets, fixed):
    """Linear elements by scikit-fem."""
    import skfem
    from skfem.helpers import dot, grad

    mesh = skfem.MeshTet(np.ascontiguousarray(points.T), np.ascontiguousarray(tets.T))
    basis = skfem.Basis(mesh, skfem.ElementTetP1())
    matrix = skfem.BilinearForm(lambda u, v, _: dot(grad(u), grad(v))).assemble(basis)
    load = skfem.LinearForm(lambda v, _: 6.0 * v).assemble(basis)
    return skfem.solve(*skfem.condense(matrix, load, D=fixed))


def scikit_fem(tetmill, folder, level, parts):
    import meshio

    out = generate(tetmill, folder, level, "msh", parts)
    mesh = meshio.read(glob.glob(out + "/*.msh")[0])
    tets, triangles = mesh.cells_dict["tetra"], mesh.cells_dict["triangle"]
    tag = mesh.field_data["skin"][0]
    fixed = np.unique(triangles[mesh.cell_data_dict["gmsh:physical"]["triangle"] == tag])
    return mesh.points, tets, solve(mesh.points, tets, fixed)


def scikit_fem_vtu(tetmill, folder, level, parts):
    import meshio
    import skfem.io

    out = generate(tetmill, folder, level, "vtu", parts, "--boundary", "in")
    file = meshio.read(out + "/ball.vtu")
    file.cell_data_to_sets("BoundaryId")
    mesh = skfem.io.from_meshio(file)
    fixed = np.unique(mesh.facets[:, mesh.boundaries["set-BoundaryId-1"]])
    points, tets = mesh.p.T, mesh.t.T
    return points, tets, solve(points, tets, fixed)


def ngsolve(tetmill, folder, level, parts):
    import ngsolve as ng

    out = generate(tetmill, folder, level, "vol", parts)
    mesh = ng.Mesh(glob.glob(out + "/*.vol")[0])
    space = ng.H1(mesh, order=1, dirichlet="skin")
    u, v = space.TnT()
    matrix = ng.BilinearForm(ng.grad(u) * ng.grad(v) * ng.dx).Assemble()
    load = ng.LinearForm(6 * v * ng.dx).Assemble()
    solution = ng.GridFunction(space)
    solution.vec.data = matrix.mat.Inverse(space.FreeDofs(), "sparsecholesky") * load.vec
    points = np.array([vertex.point for vertex in mesh.vertices])
    tets = np.array([[v.nr for v in element.vertices] for element in mesh.Elements(ng.VOL)])
    return points, tets, np.array(solution.vec)[: len(points)]


def mfem(tetmill, folder, level, parts):
    import mfem.ser as mf

    out = generate(tetmill, folder, level, "msh", parts)
    mesh = mf.Mesh(glob.glob(out + "/*.msh")[0])
    space = mf.FiniteElementSpace(mesh, mf.H1_FECollection(1, 3))
    marked = mf.intArray([0] * mesh.bdr_attributes.Max())
    marked[mesh.bdr_attributes[0] - 1] = 1
    fixed = mf.intArray()
    space.GetEssentialTrueDofs(marked, fixed)
    load = mf.LinearForm(space)
    load.AddDomainIntegrator(mf.DomainLFIntegrator(mf.ConstantCoefficient(6.0)))
    load.Assemble()
    form = mf.BilinearForm(space)
    form.AddDomainIntegrator(mf.DiffusionIntegrator(mf.ConstantCoefficient(1.0)))
    form.Assemble()
    solution = mf.GridFunction(space)
    solution.Assign(0.0)
    matrix, x, b = mf.OperatorPtr(), mf.Vector(), mf.Vector()
    form.FormLinearSystem(fixed, solution, load, matrix, x, b)
    mf.PCG(matrix, mf.GSSmoother(mf.OperatorHandle2SparseMatrix(matrix)), b, x, 0, 5000, 1e-26, 0.0)
    form.RecoverFEMSolution(x, load, solution)
    points = np.array(mesh.GetVertexArray())
    tets = np.array([mesh.GetElementVertices(i) for i in range(mesh.GetNE())])
    return points, tets, np.array(solution.GetDataArray())


SIF = """Header
 Mesh DB "." "mesh"
End
Simulation
 Max Output Level = 3
 Coordinate System = Cartesian 3D
 Simulation Type = Steady State
 Steady State Max Iterations = 1
 Use Mesh Names = True
End
Body 1
 Name = inside
 Equation = 1
 Material = 1
 Body Force = 1
End
Equation 1
 Active Solvers(1) = 1
End
Material 1
 Heat Conductivity = 1
 Density = 1
End
Body Force 1
 Heat Source = 6
End
Boundary Condition 1
 Name = skin
 Temperature = 0
End
Solver 1
 Equation = Heat Equation
 Procedure = "HeatSolve" "HeatSolver"
 Variable = Temperature
 Nonlinear System Max Iterations = 1
 Linear System Solver = Iterative
 Linear System Iterative Method = CG
 Linear System Max Iterations = 20000
 Linear System Convergence Tolerance = 1.0e-13
 Linear System Preconditioning = Diagonal
 Linear System Residual Output = 0
End
Solver 2
 Exec Solver = After all
 Equation = out
 Procedure = "ResultOutputSolve" "ResultOutputSolver"
 Output File Name = "res"
 Vtu Format = True
 Single Precision = False
End
"""


def elmer(solver, tetmill, folder, level, parts, *more):
    import meshio

    out = generate(tetmill, folder, level, "elmer", parts, *more)
    run = tempfile.mkdtemp(dir=folder)
    os.symlink(out, os.path.join(run, "mesh"))
    for name, text in ("case.sif", SIF), ("ELMERSOLVER_STARTINFO", "case.sif\n1\n"):
        with open(os.path.join(run, name), "w") as file:
            file.write(text)
    # On one rank ElmerSolver ends without MPI_Finalize, so mpirun reports a failure; the files show whether it worked.
    ran = subprocess.run(["mpirun", "-np", str(parts), solver], cwd=run, capture_output=True, text=True)
    files = sorted(glob.glob(run + "/res*.vtu") + glob.glob(out + "/res*.vtu"))
    if len(files) != parts:
        raise SystemExit(f"ElmerSolver wrote {len(files)} files of {parts} in {run}:\n{ran.stdout[-2000:]}{ran.stderr[-2000:]}")
    points, tets, values = [], [], []
    for path in files:
        part = meshio.read(path)
        tets.append(part.cells_dict["tetra"] + sum(map(len, points)))
        points.append(part.points)
        key = next(key for key in part.point_data if key.lower() == "temperature")
        values.append(np.asarray(part.point_data[key]).reshape(-1))
    return np.concatenate(points), np.concatenate(tets), np.concatenate(values)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("tetmill")
    options.add_argument("--elmer", metavar="ELMERSOLVER_MPI")
    options.add_argument("--levels", type=int, default=3)
    options = options.parse_args()
    tetmill = os.path.abspath(options.tetmill)
    cases = [
        ("scikit-fem, meshio", "msh", [1, 7], scikit_fem),
        ("scikit-fem, meshio", "vtu --boundary in", [1], scikit_fem_vtu),
        ("NGSolve", "vol", [1, 7], ngsolve),
        ("MFEM", "msh", [1, 7], mfem),
    ]
    if options.elmer:
        for more in [], ["--halo", "faces"], ["-m", "surface"], ["-m", "decompose"]:
            solve_so = lambda *of, more=more: elmer(options.elmer, *of, *more)
            cases.append(("Elmer", " ".join(["elmer", *more]), [4, 16] if more else [1, 4, 16], solve_so))
    print("| solver | format | parts | error from level to level | last ratio |\n|---|---|---|---|---|")
    for name, form, numbers, run in cases:
        for parts in numbers:
            with tempfile.TemporaryDirectory() as folder:
                try:
                    errors = [error(*run(tetmill, folder, level, parts)) for level in range(options.levels + 1)]
                except ImportError as missing:
                    print(f"| {name} | {form} | {parts} | not run: {missing} | |")
                    continue
            ratio = errors[-2] / errors[-1]
            print(f"| {name} | {form} | {parts} | {', '.join(f'{e:.3e}' for e in errors)} | {ratio:.2f} |", flush=True)


if __name__ == "__main__":
    main()
