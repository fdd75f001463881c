/* Poisson's equation on half a ball with linear elements, by conjugate gradients across parts.
 *
 *     cc poisson.c $(pkg-config --cflags --libs tetmill) -lm -o poisson && ./poisson 4
 *     mpicc poisson.c $(pkg-config --cflags --libs tetmill) -lm -o poisson && mpirun -n 4 ./poisson
 *
 * The exact solution is known. It is prescribed on the boundary `dome` (Dirichlet), its normal
 * derivative on the boundary `base` (Neumann). The error falls as the square of the element size:
 * by four from level to level. The parts are those of one process (the argument, 1 by default), or,
 * with a library built with MPI, one for each process. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <tetmill.h>

#define LEVELS 3
#define MOST_ITERATIONS 2000

static const char *GEOMETRY = "algebraic3d\n"
                              "solid floor = plane (0, 0, 0; 0, 0, -1) -bcname=base;\n"
                              "solid ball = sphere (0, 0, 0; 1) -bcname=dome;\n"
                              "solid half = floor and ball;\n"
                              "tlo half;\n";

static double exact(const double *p) { return sin(2 * p[0]) * cos(p[1]) + p[2] * p[2] + p[2]; }
/* Minus the Laplacian of the exact solution. */
static double source(const double *p) { return 5 * sin(2 * p[0]) * cos(p[1]) - 2; }
/* The derivative of the exact solution along the outward normal (0, 0, -1) of the base. */
static const double BASE_FLUX = -1;

/* Ends the program if a call has failed. */
static void check(tetmill_status status) {
    if (status == TETMILL_STATUS_OK)
        return;
    fprintf(stderr, "poisson: %s\n", tetmill_last_error());
#ifdef TETMILL_MPI
    MPI_Abort(MPI_COMM_WORLD, (int)status);
#endif
    exit((int)status);
}

static void *allocate(size_t count, size_t size) {
    void *memory = calloc(count ? count : 1, size);
    if (!memory) {
        fputs("poisson: no memory\n", stderr);
        exit(TETMILL_STATUS_RESOURCES);
    }
    return memory;
}

/* The sum over all processes. */
static double sum(double value) {
#ifdef TETMILL_MPI
    MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
#endif
    return value;
}

/* A part, and its matrices: four by four for each tet. */
typedef struct {
    size_t vertices, tets, triangles;
    const double *xyz;
    const uint32_t *tet, *owner, *triangle, *patch;
    const int32_t *sides;
    uint32_t rank;
    double *matrix;
} part;

typedef struct {
    tetmill_mesh *mesh;
    size_t parts;
    part *part;
    unsigned char **fixed;
} problem;

/* One vector for each part. */
static double **vectors(const problem *p) {
    double **v = allocate(p->parts, sizeof *v);
    for (size_t k = 0; k < p->parts; ++k)
        v[k] = allocate(p->part[k].vertices, sizeof **v);
    return v;
}

static void free_all(const problem *p, void **v) {
    for (size_t k = 0; k < p->parts; ++k)
        free(v[k]);
    free(v);
}

/* The scalar product: each shared vertex counts on its owner only. */
static double dot(const problem *p, double **a, double **b) {
    double value = 0;
    for (size_t k = 0; k < p->parts; ++k)
        for (size_t v = 0; v < p->part[k].vertices; ++v)
            if (p->part[k].owner[v] == p->part[k].rank)
                value += a[k][v] * b[k][v];
    return sum(value);
}

/* The volume of a tet, and the gradients of its four linear functions. */
static double gradients(const part *m, size_t t, double g[4][3]) {
    const double *x[4];
    double e[3][3], volume;
    for (int i = 0; i < 4; ++i)
        x[i] = m->xyz + 3 * m->tet[4 * t + i];
    for (int i = 0; i < 3; ++i)
        for (int c = 0; c < 3; ++c)
            e[i][c] = x[i + 1][c] - x[0][c];
    for (int i = 0; i < 3; ++i) {
        const double *a = e[(i + 1) % 3], *b = e[(i + 2) % 3];
        for (int c = 0; c < 3; ++c)
            g[i + 1][c] = a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
    }
    volume = (e[0][0] * g[1][0] + e[0][1] * g[1][1] + e[0][2] * g[1][2]) / 6;
    for (int c = 0; c < 3; ++c) {
        for (int i = 1; i < 4; ++i)
            g[i][c] /= 6 * volume;
        g[0][c] = -g[1][c] - g[2][c] - g[3][c];
    }
    return volume;
}

/* Four points in a tet, exact for quadratic polynomials (Keast 1986): stores the k-th of them. */
static void quadrature(const part *m, size_t t, int k, double point[3], double weight[4]) {
    point[0] = point[1] = point[2] = 0;
    for (int i = 0; i < 4; ++i) {
        weight[i] = i == k ? 0.5854101966249685 : 0.1381966011250105;
        for (int c = 0; c < 3; ++c)
            point[c] += weight[i] * m->xyz[3 * m->tet[4 * t + i] + c];
    }
}

/* The matrices and the load of the tets of a part. */
static void assemble(part *m, double *load) {
    m->matrix = allocate(16 * m->tets, sizeof *m->matrix);
    for (size_t t = 0; t < m->tets; ++t) {
        double g[4][3], point[3], weight[4], volume = gradients(m, t, g);
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < 4; ++j)
                m->matrix[16 * t + 4 * i + j] = volume * (g[i][0] * g[j][0] + g[i][1] * g[j][1] + g[i][2] * g[j][2]);
        for (int k = 0; k < 4; ++k) {
            quadrature(m, t, k, point, weight);
            for (int i = 0; i < 4; ++i)
                load[m->tet[4 * t + i]] += volume / 4 * weight[i] * source(point);
        }
    }
}

/* Whether a patch is one of those with a name. */
static int is_named(const tetmill_mesh *mesh, const char *name, uint32_t patch) {
    uint32_t patches[16];
    size_t count;
    check(tetmill_mesh_patches_named(mesh, name, patches, 16, &count));
    for (size_t k = 0; k < count && k < 16; ++k)
        if (patches[k] == patch)
            return 1;
    return 0;
}

static double area(const part *m, const uint32_t *v) {
    const double *a = m->xyz + 3 * v[0], *b = m->xyz + 3 * v[1], *c = m->xyz + 3 * v[2];
    double n[3];
    for (int i = 0; i < 3; ++i) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        n[i] = (b[j] - a[j]) * (c[k] - a[k]) - (b[k] - a[k]) * (c[j] - a[j]);
    }
    return sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / 2;
}

/* Boundary data by name: fixed vertices on the dome, flux through the base. */
static void boundary(const tetmill_mesh *mesh, const part *m, double *load, unsigned char *fixed) {
    for (size_t t = 0; t < m->triangles; ++t) {
        const uint32_t *v = m->triangle + 3 * t;
        if (is_named(mesh, "dome", m->patch[t]))
            fixed[v[0]] = fixed[v[1]] = fixed[v[2]] = 1;
        /* A triangle counts on the part that has the tet behind it. */
        else if (is_named(mesh, "base", m->patch[t]) && m->sides[2 * t] >= 0)
            for (int i = 0; i < 3; ++i)
                load[v[i]] += BASE_FLUX * area(m, v) / 3;
    }
}

/* out = matrix * in, with zeros at fixed vertices. */
static void apply(const problem *p, double **in, double **out) {
    for (size_t k = 0; k < p->parts; ++k) {
        const part *m = &p->part[k];
        for (size_t v = 0; v < m->vertices; ++v)
            out[k][v] = 0;
        for (size_t t = 0; t < m->tets; ++t)
            for (int i = 0; i < 4; ++i)
                for (int j = 0; j < 4; ++j)
                    out[k][m->tet[4 * t + i]] += m->matrix[16 * t + 4 * i + j] * in[k][m->tet[4 * t + j]];
    }
    check(tetmill_mesh_sum(p->mesh, out));
    for (size_t k = 0; k < p->parts; ++k)
        for (size_t v = 0; v < p->part[k].vertices; ++v)
            if (p->fixed[k][v])
                out[k][v] = 0;
}

/* a = scale_a * a + scale_b * b */
static void combine(const problem *p, double scale_a, double **a, double scale_b, double **b) {
    for (size_t k = 0; k < p->parts; ++k)
        for (size_t v = 0; v < p->part[k].vertices; ++v)
            a[k][v] = scale_a * a[k][v] + scale_b * b[k][v];
}

/* Solves for a solution whose fixed vertices have their values; returns the iterations. */
static int solve(const problem *p, double **load, double **solution) {
    double **direction = vectors(p), **product = vectors(p), first, before, now;
    int iteration = 0;
    apply(p, solution, product);
    combine(p, 1, load, -1, product); /* the residual */
    for (size_t k = 0; k < p->parts; ++k)
        for (size_t v = 0; v < p->part[k].vertices; ++v)
            if (p->fixed[k][v])
                load[k][v] = 0;
    combine(p, 0, direction, 1, load);
    first = before = dot(p, load, load);
    while (before > 1e-24 * first && iteration < MOST_ITERATIONS) {
        double step;
        apply(p, direction, product);
        step = before / dot(p, direction, product);
        combine(p, 1, solution, step, direction);
        combine(p, 1, load, -step, product);
        now = dot(p, load, load);
        combine(p, now / before, direction, 1, load);
        before = now;
        ++iteration;
    }
    free_all(p, (void **)direction);
    free_all(p, (void **)product);
    return iteration;
}

/* The error in the mean square. */
static double error_of(const problem *p, double **solution) {
    double error = 0;
    for (size_t k = 0; k < p->parts; ++k)
        for (size_t t = 0; t < p->part[k].tets; ++t) {
            const part *m = &p->part[k];
            double g[4][3], point[3], weight[4], volume = gradients(m, t, g);
            for (int q = 0; q < 4; ++q) {
                double value = 0;
                quadrature(m, t, q, point, weight);
                for (int i = 0; i < 4; ++i)
                    value += weight[i] * solution[k][m->tet[4 * t + i]];
                error += volume / 4 * (value - exact(point)) * (value - exact(point));
            }
        }
    return sqrt(sum(error));
}

/* Borrows the arrays of a part. */
static part arrays(const tetmill_mesh *mesh, size_t index) {
    part m = {0};
    const tetmill_part *of;
    size_t count;
    check(tetmill_mesh_part(mesh, index, &of));
    check(tetmill_part_rank(of, &m.rank));
    check(tetmill_part_points(of, &m.xyz, &m.vertices));
    check(tetmill_part_owners(of, &m.owner, &count));
    check(tetmill_part_tets(of, &m.tet, &m.tets));
    check(tetmill_part_triangles(of, &m.triangle, &m.triangles));
    check(tetmill_part_triangle_patches(of, &m.patch, &count));
    check(tetmill_part_triangle_bodies(of, &m.sides, &count));
    return m;
}

/* Assembles and solves; returns the error. */
static double run(tetmill_mesh *mesh, int *iterations) {
    problem p = {.mesh = mesh};
    double **load, **solution, error;
    check(tetmill_mesh_part_count(mesh, &p.parts));
    p.part = allocate(p.parts, sizeof *p.part);
    p.fixed = allocate(p.parts, sizeof *p.fixed);
    for (size_t k = 0; k < p.parts; ++k)
        p.part[k] = arrays(mesh, k);
    load = vectors(&p);
    solution = vectors(&p);
    for (size_t k = 0; k < p.parts; ++k) {
        p.fixed[k] = allocate(p.part[k].vertices, 1);
        assemble(&p.part[k], load[k]);
        boundary(mesh, &p.part[k], load[k], p.fixed[k]);
    }
    check(tetmill_mesh_sum(mesh, load));
    /* A part may have a vertex of the dome without a triangle there. */
    check(tetmill_mesh_any(mesh, p.fixed));
    for (size_t k = 0; k < p.parts; ++k)
        for (size_t v = 0; v < p.part[k].vertices; ++v)
            if (p.fixed[k][v])
                solution[k][v] = exact(p.part[k].xyz + 3 * v);
    *iterations = solve(&p, load, solution);
    error = error_of(&p, solution);
    for (size_t k = 0; k < p.parts; ++k)
        free(p.part[k].matrix);
    free_all(&p, (void **)p.fixed);
    free_all(&p, (void **)load);
    free_all(&p, (void **)solution);
    free(p.part);
    return error;
}

int main(int argc, char **argv) {
    unsigned parts = argc > 1 ? (unsigned)atoi(argv[1]) : 1;
    int rank = 0, falls = 1;
    double before = 0;
    tetmill_geometry *geometry = NULL;
    tetmill_options *options;
#ifdef TETMILL_MPI
    int level_of_threads;
    MPI_Init_thread(&argc, &argv, MPI_THREAD_FUNNELED, &level_of_threads);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    parts = argc > 1 ? parts : 0;
#endif
    /* The process of rank 0 makes the coarse mesh; the others need no geometry. */
    if (rank == 0)
        check(tetmill_geometry_from_text(GEOMETRY, &geometry));
    check(tetmill_options_new(&options));
    check(tetmill_options_set(options, "maxh", "0.5"));
    for (unsigned level = 1; level <= LEVELS; ++level) {
        tetmill_mesh *mesh;
        uint64_t vertices, tets, triangles;
        int iterations;
        double error;
        check(tetmill_options_set_levels(options, level));
#ifdef TETMILL_MPI
        check(tetmill_generate_comm(geometry, options, MPI_COMM_WORLD, parts, &mesh));
#else
        check(tetmill_generate(geometry, options, parts, &mesh));
#endif
        check(tetmill_mesh_totals(mesh, &vertices, &tets, &triangles));
        error = run(mesh, &iterations);
        if (rank == 0)
            printf("level %u: %llu tets, %d iterations, error %.9e\n", level, (unsigned long long)tets, iterations, error);
        falls = falls && (level == 1 || before / error > 3.4);
        before = error;
        tetmill_mesh_free(mesh);
    }
    tetmill_options_free(options);
    tetmill_geometry_free(geometry);
#ifdef TETMILL_MPI
    MPI_Finalize();
#endif
    if (!falls)
        fputs("the error does not fall as the square of the element size\n", stderr);
    return !falls;
}
