// Poisson's equation on half a ball with MFEM, on the processes of an MPI job: no file, no serial mesh.
//
//     mpicxx mfem_poisson.cpp $(pkg-config --cflags --libs tetmill) -I$MFEM_DIR -L$MFEM_DIR -lmfem ... -o mfem_poisson
//     mpirun -n 4 ./mfem_poisson
//
// The equation and its boundaries are those of poisson.c.
#include <cmath>
#include <cstdio>
#include <mfem.hpp>
#include <sstream>
#include <string>
#include <tetmill.h>

using namespace mfem;

static const char *const GEOMETRY = "algebraic3d\n"
                                    "solid floor = plane (0, 0, 0; 0, 0, -1) -bcname=base;\n"
                                    "solid ball = sphere (0, 0, 0; 1) -bcname=dome;\n"
                                    "solid half = floor and ball;\n"
                                    "tlo half;\n";

static double exact(const Vector &p) { return std::sin(2 * p[0]) * std::cos(p[1]) + p[2] * p[2] + p[2]; }
static double source(const Vector &p) { return 5 * std::sin(2 * p[0]) * std::cos(p[1]) - 2; }

static void check(tetmill_status status) {
    if (status != TETMILL_STATUS_OK) {
        std::fprintf(stderr, "mfem_poisson: %s\n", tetmill_last_error());
        MPI_Abort(MPI_COMM_WORLD, static_cast<int>(status));
    }
}

// The mesh of this process, read by MFEM from memory.
static ParMesh make_mesh(int level) {
    tetmill_geometry *geometry = nullptr;
    tetmill_options *options = nullptr;
    tetmill_mesh *mesh = nullptr;
    const tetmill_part *part = nullptr;
    const char *text = nullptr;
    size_t length = 0;
    check(tetmill_geometry_from_text(GEOMETRY, &geometry));
    check(tetmill_options_new(&options));
    check(tetmill_options_set(options, "maxh", "0.5"));
    check(tetmill_options_set(options, "levels", std::to_string(level).c_str()));
    check(tetmill_generate_comm(geometry, options, MPI_COMM_WORLD, 0, &mesh));
    check(tetmill_mesh_make_mfem(mesh));
    check(tetmill_mesh_part(mesh, 0, &part));
    check(tetmill_part_mfem(part, &text, &length));
    std::istringstream stream(std::string(text, length));
    tetmill_mesh_free(mesh);
    tetmill_options_free(options);
    tetmill_geometry_free(geometry);
    // Tets need not be prepared for local refinement by bisection.
    return ParMesh(MPI_COMM_WORLD, stream, false);
}

// Linear elements; returns the error in the mean square.
static double solve(ParMesh &mesh) {
    H1_FECollection elements(1, 3);
    ParFiniteElementSpace space(&mesh, &elements);
    FunctionCoefficient u(exact), f(source);
    ConstantCoefficient flux(-1.0);

    // Boundaries by their names.
    Array<int> dome = mesh.bdr_attribute_sets.GetAttributeSetMarker("dome");
    Array<int> base = mesh.bdr_attribute_sets.GetAttributeSetMarker("base");
    Array<int> fixed;
    space.GetEssentialTrueDofs(dome, fixed);

    ParLinearForm load(&space);
    load.AddDomainIntegrator(new DomainLFIntegrator(f, 2, 2));
    load.AddBoundaryIntegrator(new BoundaryLFIntegrator(flux), base);
    load.Assemble();
    ParBilinearForm stiffness(&space);
    stiffness.AddDomainIntegrator(new DiffusionIntegrator);
    stiffness.Assemble();
    ParGridFunction solution(&space);
    solution.ProjectCoefficient(u);

    HypreParMatrix matrix;
    Vector right, unknowns;
    stiffness.FormLinearSystem(fixed, solution, load, matrix, unknowns, right);
    HypreBoomerAMG precondition(matrix);
    precondition.SetPrintLevel(0);
    CGSolver solver(MPI_COMM_WORLD);
    solver.SetRelTol(1e-13);
    solver.SetMaxIter(500);
    solver.SetOperator(matrix);
    solver.SetPreconditioner(precondition);
    solver.Mult(right, unknowns);
    MFEM_VERIFY(solver.GetConverged(), "CG has not converged");
    stiffness.RecoverFEMSolution(unknowns, load, solution);

    return solution.ComputeL2Error(u);
}

int main(int argc, char *argv[]) {
    // Meshing uses threads: plain Mpi::Init asks MPI for none.
    Mpi::Init(argc, argv, MPI_THREAD_FUNNELED, nullptr);
    Hypre::Init();
    for (int level = 0; level < 3; ++level) {
        ParMesh mesh = make_mesh(level);
        const long long tets = mesh.GetGlobalNE();
        const double error = solve(mesh);
        if (Mpi::Root())
            std::printf("level %d: %lld tets on %d ranks, error %.10e\n", level, tets, Mpi::WorldSize(), error);
        if (level == 1) {
            // MFEM's own refinement of the parts fits together, too.
            mesh.UniformRefinement();
            const long long eightfold = mesh.GetGlobalNE();
            const double refined = solve(mesh);
            if (Mpi::Root())
                std::printf("refined by MFEM: %lld tets, flat at the boundary, error %.10e\n", eightfold, refined);
        }
    }
    return 0;
}
