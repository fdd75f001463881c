/* Poisson's equation on a DMPlex of PETSc that each rank makes of its part, without a file.
 *
 *     mpicc dmplex.c $(pkg-config --cflags --libs tetmill petsc) -lm -o dmplex && mpirun -n 4 ./dmplex
 *
 * The library must be built with MPI. DMPlex numbers vertices by rank: each rank numbers those that
 * it owns. tetmill_mesh_sum gives these numbers to the other ranks that share a vertex. The exact
 * solution is prescribed on the boundary `dome`, its normal derivative on the boundary `base`. */
#include <math.h>
#include <petscdmplex.h>
#include <petscksp.h>
#include <petscsf.h>
#include <tetmill.h>

#define LEVELS 3

static const char *GEOMETRY = "algebraic3d\n"
                              "solid floor = plane (0, 0, 0; 0, 0, -1) -bcname=base;\n"
                              "solid ball = sphere (0, 0, 0; 1) -bcname=dome;\n"
                              "solid half = floor and ball;\n"
                              "tlo half;\n";

static double exact(const double *p) { return sin(2 * p[0]) * cos(p[1]) + p[2] * p[2] + p[2]; }
static double source(const double *p) { return 5 * sin(2 * p[0]) * cos(p[1]) - 2; }
static const double BASE_FLUX = -1;

#define CHECK(call) \
    do { \
        if ((call) != TETMILL_STATUS_OK) \
            SETERRABORT(PETSC_COMM_WORLD, PETSC_ERR_LIB, tetmill_last_error()); \
    } while (0)

/* The part of this rank, and the number of each of its vertices in the DMPlex. */
typedef struct {
    const double *xyz;
    const uint32_t *tets, *owners, *triangles, *patches;
    const int32_t *sides;
    size_t vertices, cells, faces;
    double *numbers, *load;
    unsigned char *fixed;
} part;

/* Whether a triangle is on the boundary with this name, which has one patch. */
static int is_on(const tetmill_mesh *mesh, const char *name, uint32_t patch) {
    uint32_t found;
    size_t count;
    CHECK(tetmill_mesh_patches_named(mesh, name, &found, 1, &count));
    return found == patch;
}

static double area(const double *a, const double *b, const double *c) {
    double n[3];
    for (int i = 0; i < 3; ++i) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        n[i] = (b[j] - a[j]) * (c[k] - a[k]) - (b[k] - a[k]) * (c[j] - a[j]);
    }
    return sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / 2;
}

/* Fixed vertices on the dome, and the flux through the base. */
static void boundary(const tetmill_mesh *mesh, part *m) {
    for (size_t t = 0; t < m->faces; ++t) {
        const uint32_t *v = m->triangles + 3 * t;
        double flux = BASE_FLUX * area(m->xyz + 3 * v[0], m->xyz + 3 * v[1], m->xyz + 3 * v[2]);
        for (int i = 0; i < 3; ++i)
            if (is_on(mesh, "dome", m->patches[t]))
                m->fixed[v[i]] = 1;
            else if (m->sides[2 * t] >= 0)
                m->load[v[i]] += flux / 3;
    }
    CHECK(tetmill_mesh_any(mesh, &m->fixed));
}

/* Borrows the arrays, and numbers the owned vertices of rank 0, then those of rank 1, ... */
static PetscErrorCode take(const tetmill_mesh *mesh, part *m, PetscInt *owned) {
    const tetmill_part *of;
    uint32_t rank;
    size_t count;
    long long mine = 0, first = 0;
    PetscFunctionBeginUser;
    CHECK(tetmill_mesh_part(mesh, 0, &of));
    CHECK(tetmill_part_rank(of, &rank));
    CHECK(tetmill_part_points(of, &m->xyz, &m->vertices));
    CHECK(tetmill_part_owners(of, &m->owners, &count));
    CHECK(tetmill_part_tets(of, &m->tets, &m->cells));
    CHECK(tetmill_part_triangles(of, &m->triangles, &m->faces));
    CHECK(tetmill_part_triangle_patches(of, &m->patches, &count));
    CHECK(tetmill_part_triangle_bodies(of, &m->sides, &count));
    PetscCall(PetscCalloc3(m->vertices, &m->numbers, m->vertices, &m->load, m->vertices, &m->fixed));
    for (size_t v = 0; v < m->vertices; ++v)
        mine += m->owners[v] == rank;
    PetscCallMPI(MPI_Exscan(&mine, &first, 1, MPI_LONG_LONG, MPI_SUM, PETSC_COMM_WORLD));
    *owned = (PetscInt)mine;
    for (size_t v = 0; v < m->vertices; ++v)
        if (m->owners[v] == rank)
            m->numbers[v] = (double)first++;
    CHECK(tetmill_mesh_sum(mesh, &m->numbers));
    boundary(mesh, m);
    PetscFunctionReturn(0);
}

/* The DMPlex; `index` has for each of its vertices the local index of the part. */
static PetscErrorCode make_dm(const part *m, PetscInt owned, DM *dm, PetscInt **index) {
    static const int ORDER[4] = {0, 2, 1, 3}; /* PETSc's tets have the other orientation. */
    PetscInt *cells, *mine, *theirs, first, last, *by_number, low = 0, own = 0;
    PetscSF numbers;
    PetscReal *xyz;
    PetscFunctionBeginUser;
    PetscCall(PetscMalloc2(4 * m->cells, &cells, 3 * owned, &xyz));
    for (size_t c = 0; c < m->cells; ++c)
        for (int i = 0; i < 4; ++i)
            cells[4 * c + i] = (PetscInt)m->numbers[m->tets[4 * c + ORDER[i]]];
    PetscCallMPI(MPI_Exscan(&owned, &low, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
    for (size_t v = 0; v < m->vertices; ++v)
        if (m->numbers[v] >= low && m->numbers[v] < low + owned) {
            for (int i = 0; i < 3; ++i)
                xyz[3 * ((PetscInt)m->numbers[v] - low) + i] = m->xyz[3 * v + i];
            ++own;
        }
    PetscCheck(own == owned, PETSC_COMM_SELF, PETSC_ERR_PLIB, "a vertex without an owner");
    PetscCall(DMPlexCreateFromCellListParallelPetsc(PETSC_COMM_WORLD, 3, (PetscInt)m->cells, owned, PETSC_DECIDE, 4,
                                                    PETSC_TRUE, cells, 3, xyz, &numbers, NULL, dm));
    PetscCall(PetscFree2(cells, xyz));
    PetscCall(DMPlexGetDepthStratum(*dm, 0, &first, &last));
    PetscCheck((size_t)(last - first) == m->vertices, PETSC_COMM_SELF, PETSC_ERR_PLIB, "another number of vertices");
    /* Both have the same vertices: those of the same cells. Match them by their numbers. */
    PetscCall(PetscMalloc1(m->vertices, index));
    PetscCall(PetscMalloc4(m->vertices, &by_number, m->vertices, &cells, owned, &mine, m->vertices, &theirs));
    for (PetscInt v = 0; v < owned; ++v)
        mine[v] = low + v;
    PetscCall(PetscSFBcastBegin(numbers, MPIU_INT, mine, theirs, MPI_REPLACE));
    PetscCall(PetscSFBcastEnd(numbers, MPIU_INT, mine, theirs, MPI_REPLACE));
    PetscCall(PetscSFDestroy(&numbers));
    for (PetscInt v = 0; v < (PetscInt)m->vertices; ++v) {
        by_number[v] = v;
        cells[v] = (PetscInt)m->numbers[v];
    }
    PetscCall(PetscSortIntWithArray((PetscInt)m->vertices, cells, by_number));
    for (PetscInt v = 0; v < last - first; ++v) {
        PetscInt place;
        PetscCall(PetscFindInt(theirs[v], (PetscInt)m->vertices, cells, &place));
        PetscCheck(place >= 0, PETSC_COMM_SELF, PETSC_ERR_PLIB, "an unknown vertex");
        (*index)[v] = by_number[place];
    }
    PetscCall(PetscFree4(by_number, cells, mine, theirs));
    PetscFunctionReturn(0);
}

/* One unknown for each vertex. */
static PetscErrorCode set_unknowns(DM dm) {
    PetscSection section;
    PetscInt first, last, start, end;
    PetscFunctionBeginUser;
    PetscCall(DMPlexGetChart(dm, &start, &end));
    PetscCall(DMPlexGetDepthStratum(dm, 0, &first, &last));
    PetscCall(PetscSectionCreate(PETSC_COMM_WORLD, &section));
    PetscCall(PetscSectionSetChart(section, start, end));
    for (PetscInt v = first; v < last; ++v)
        PetscCall(PetscSectionSetDof(section, v, 1));
    PetscCall(PetscSectionSetUp(section));
    PetscCall(DMSetLocalSection(dm, section));
    PetscCall(PetscSectionDestroy(&section));
    PetscFunctionReturn(0);
}

/* The volume of a cell, and the gradients of its four linear functions. */
static double gradients(const PetscScalar *x, double g[4][3]) {
    double e[3][3], volume;
    for (int i = 0; i < 3; ++i)
        for (int c = 0; c < 3; ++c)
            e[i][c] = x[3 * (i + 1) + c] - x[c];
    for (int i = 0; i < 3; ++i)
        for (int c = 0; c < 3; ++c)
            g[i + 1][c] = e[(i + 1) % 3][(c + 1) % 3] * e[(i + 2) % 3][(c + 2) % 3] -
                          e[(i + 1) % 3][(c + 2) % 3] * e[(i + 2) % 3][(c + 1) % 3];
    volume = (e[0][0] * g[1][0] + e[0][1] * g[1][1] + e[0][2] * g[1][2]) / 6;
    for (int c = 0; c < 3; ++c) {
        for (int i = 1; i < 4; ++i)
            g[i][c] /= 6 * volume;
        g[0][c] = -g[1][c] - g[2][c] - g[3][c];
    }
    return fabs(volume);
}

/* The k-th of four points in a tet, exact for quadratic polynomials (Keast 1986). */
static void quadrature(const PetscScalar *x, int k, double point[3], double weight[4]) {
    point[0] = point[1] = point[2] = 0;
    for (int i = 0; i < 4; ++i) {
        weight[i] = i == k ? 0.5854101966249685 : 0.1381966011250105;
        for (int c = 0; c < 3; ++c)
            point[c] += weight[i] * x[3 * i + c];
    }
}

/* Adds the matrices and loads of all cells, or, with a solution, sums the squares of its error. */
static PetscErrorCode integrate(DM dm, Mat matrix, Vec load, Vec solution, double *error) {
    DM of_points;
    Vec points;
    PetscSection layout;
    PetscInt first, last;
    PetscFunctionBeginUser;
    PetscCall(DMGetCoordinateDM(dm, &of_points));
    PetscCall(DMGetCoordinatesLocal(dm, &points));
    PetscCall(DMGetLocalSection(of_points, &layout));
    PetscCall(DMPlexGetHeightStratum(dm, 0, &first, &last));
    for (PetscInt cell = first; cell < last; ++cell) {
        PetscScalar *x = NULL, *u = NULL, a[16], b[4] = {0};
        double g[4][3], point[3], weight[4], volume;
        PetscCall(DMPlexVecGetClosure(of_points, layout, points, cell, NULL, &x));
        volume = gradients(x, g);
        if (solution)
            PetscCall(DMPlexVecGetClosure(dm, NULL, solution, cell, NULL, &u));
        for (int q = 0; q < 4; ++q) {
            double off = 0;
            quadrature(x, q, point, weight);
            for (int i = 0; i < 4; ++i)
                b[i] += volume / 4 * weight[i] * source(point);
            for (int i = 0; solution && i < 4; ++i)
                off += weight[i] * u[i];
            off -= exact(point);
            if (solution)
                *error += volume / 4 * off * off;
        }
        for (int i = 0; i < 16; ++i)
            a[i] = volume * (g[i / 4][0] * g[i % 4][0] + g[i / 4][1] * g[i % 4][1] + g[i / 4][2] * g[i % 4][2]);
        if (solution) {
            PetscCall(DMPlexVecRestoreClosure(dm, NULL, solution, cell, NULL, &u));
        } else {
            PetscCall(DMPlexMatSetClosure(dm, NULL, NULL, matrix, cell, a, ADD_VALUES));
            PetscCall(DMPlexVecSetClosure(dm, NULL, load, cell, b, ADD_ALL_VALUES));
        }
        PetscCall(DMPlexVecRestoreClosure(of_points, layout, points, cell, NULL, &x));
    }
    PetscFunctionReturn(0);
}

/* Adds the boundary's load, and prescribes the exact solution at fixed vertices. */
static PetscErrorCode prescribe(DM dm, const part *m, const PetscInt *index, Mat matrix, Vec local, Vec load, Vec solution) {
    PetscSection global;
    PetscScalar *values;
    PetscInt first, last, *rows, count = 0;
    PetscFunctionBeginUser;
    PetscCall(DMGetGlobalSection(dm, &global));
    PetscCall(DMPlexGetDepthStratum(dm, 0, &first, &last));
    PetscCall(PetscMalloc1(m->vertices, &rows));
    PetscCall(VecGetArray(local, &values));
    for (PetscInt v = 0; v < last - first; ++v)
        values[v] += m->load[index[v]];
    PetscCall(VecRestoreArray(local, &values));
    PetscCall(DMLocalToGlobal(dm, local, ADD_VALUES, load));
    for (PetscInt v = 0; v < last - first; ++v) {
        PetscInt row;
        PetscCall(PetscSectionGetOffset(global, first + v, &row));
        /* Negative offsets are those of other ranks. */
        if (row >= 0 && m->fixed[index[v]]) {
            PetscCall(VecSetValue(solution, row, exact(m->xyz + 3 * index[v]), INSERT_VALUES));
            rows[count++] = row;
        }
    }
    PetscCall(VecAssemblyBegin(solution));
    PetscCall(VecAssemblyEnd(solution));
    PetscCall(MatAssemblyBegin(matrix, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(matrix, MAT_FINAL_ASSEMBLY));
    PetscCall(MatZeroRowsColumns(matrix, count, rows, 1, solution, load));
    PetscCall(PetscFree(rows));
    PetscFunctionReturn(0);
}

/* Assembles and solves on one mesh. */
static PetscErrorCode run(const tetmill_mesh *mesh, double *error) {
    part m = {0};
    DM dm;
    Mat matrix;
    Vec local, load, solution;
    KSP solver;
    PC jacobi;
    PetscInt owned = 0, *index;
    PetscFunctionBeginUser;
    PetscCall(take(mesh, &m, &owned));
    PetscCall(make_dm(&m, owned, &dm, &index));
    PetscCall(set_unknowns(dm));
    PetscCall(DMCreateMatrix(dm, &matrix));
    PetscCall(DMCreateLocalVector(dm, &local));
    PetscCall(DMCreateGlobalVector(dm, &load));
    PetscCall(VecDuplicate(load, &solution));
    PetscCall(VecSet(local, 0));
    PetscCall(integrate(dm, matrix, local, NULL, NULL));
    PetscCall(prescribe(dm, &m, index, matrix, local, load, solution));
    PetscCall(KSPCreate(PETSC_COMM_WORLD, &solver));
    PetscCall(KSPSetOperators(solver, matrix, matrix));
    PetscCall(KSPSetType(solver, KSPCG));
    PetscCall(KSPGetPC(solver, &jacobi));
    PetscCall(PCSetType(jacobi, PCJACOBI));
    PetscCall(KSPSetTolerances(solver, 1e-12, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
    PetscCall(KSPSolve(solver, load, solution));
    PetscCall(DMGlobalToLocal(dm, solution, INSERT_VALUES, local));
    *error = 0;
    PetscCall(integrate(dm, NULL, NULL, local, error));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, error, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD));
    *error = sqrt(*error);
    PetscCall(KSPDestroy(&solver));
    PetscCall(VecDestroy(&solution));
    PetscCall(VecDestroy(&load));
    PetscCall(VecDestroy(&local));
    PetscCall(MatDestroy(&matrix));
    PetscCall(DMDestroy(&dm));
    PetscCall(PetscFree(index));
    PetscCall(PetscFree3(m.numbers, m.load, m.fixed));
    PetscFunctionReturn(0);
}

int main(int argc, char **argv) {
    tetmill_geometry *geometry = NULL;
    tetmill_options *options;
    PetscMPIInt rank;
    double before = 0;
    PETSC_MPI_THREAD_REQUIRED = MPI_THREAD_FUNNELED;
    PetscCall(PetscInitialize(&argc, &argv, NULL, NULL));
    PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
    if (rank == 0)
        CHECK(tetmill_geometry_from_text(GEOMETRY, &geometry));
    CHECK(tetmill_options_new(&options));
    CHECK(tetmill_options_set(options, "maxh", "0.5"));
    for (unsigned level = 1; level <= LEVELS; ++level) {
        tetmill_mesh *mesh;
        uint64_t vertices, tets, triangles;
        double error;
        CHECK(tetmill_options_set_levels(options, level));
        CHECK(tetmill_generate_comm(geometry, options, PETSC_COMM_WORLD, 0, &mesh));
        CHECK(tetmill_mesh_totals(mesh, &vertices, &tets, &triangles));
        PetscCall(run(mesh, &error));
        PetscCall(PetscPrintf(PETSC_COMM_WORLD, "level %u: %llu tets, error %.9e\n", level, (unsigned long long)tets, error));
        PetscCheck(level == 1 || before / error > 3.4, PETSC_COMM_WORLD, PETSC_ERR_NOT_CONVERGED,
                   "the error does not fall as the square of the element size");
        before = error;
        tetmill_mesh_free(mesh);
    }
    tetmill_options_free(options);
    tetmill_geometry_free(geometry);
    PetscCall(PetscFinalize());
    return 0;
}
