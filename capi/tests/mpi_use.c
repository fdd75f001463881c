/* Use of the C interface across MPI processes: errors are errors on all, and MFEM's text of each.
 * The argument is the name of the texts. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <tetmill.h>

static const char *BALL = "algebraic3d solid b = sphere (0, 0, 0; 1) -bcname=wall; tlo b;";
static int failures, rank, size;

static void expect(int line, tetmill_status status, tetmill_status expected, const char *words) {
    if (status == expected && (expected == TETMILL_STATUS_OK || strstr(tetmill_last_error(), words)))
        return;
    fprintf(stderr, "rank %d, line %d: status %d instead of %d, text `%s`\n", rank, line, status, expected, tetmill_last_error());
    ++failures;
}

#define EXPECT(call, expected, words) expect(__LINE__, call, TETMILL_STATUS_##expected, words)

static double negative(const double *xyz, void *user) {
    (void)user;
    return xyz[0] > 10 ? 1 : -1;
}

static void write_text(const tetmill_mesh *mesh, const char *name) {
    const tetmill_part *part;
    const char *text;
    size_t length;
    char path[4096];
    FILE *file;
    EXPECT(tetmill_mesh_make_mfem(mesh), OK, "");
    EXPECT(tetmill_mesh_part(mesh, 0, &part), OK, "");
    EXPECT(tetmill_part_mfem(part, &text, &length), OK, "");
    snprintf(path, sizeof path, "%s.%06d", name, rank);
    file = fopen(path, "wb");
    if (!file || fwrite(text, 1, length, file) != length || fclose(file))
        ++failures;
}

int main(int argc, char **argv) {
    tetmill_geometry *ball = NULL, *own;
    MPI_Comm half;
    tetmill_options *options;
    tetmill_mesh *mesh;
    int provided;
    EXPECT(tetmill_generate_comm(NULL, NULL, MPI_COMM_WORLD, 0, &mesh), USAGE, "not initialised");
    MPI_Init_thread(&argc, &argv, MPI_THREAD_FUNNELED, &provided);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &size);
    EXPECT(tetmill_options_new(&options), OK, "");
    EXPECT(tetmill_generate_comm(NULL, NULL, MPI_COMM_NULL, 0, &mesh), USAGE, "MPI_COMM_NULL");
    EXPECT(tetmill_generate_comm(NULL, NULL, MPI_COMM_WORLD, 0, &mesh), INPUT, "rank 0 has no geometry");
    if (rank == 0)
        EXPECT(tetmill_geometry_from_text(BALL, &ball), OK, "");
    /* Different settings, a wrong value of the size function, settings that rank 0 alone refuses. */
    EXPECT(tetmill_options_set_levels(options, (unsigned)(rank == 1)), OK, "");
    if (size > 1)
        EXPECT(tetmill_generate_comm(ball, options, MPI_COMM_WORLD, 0, &mesh), INPUT, "levels");
    EXPECT(tetmill_options_set_levels(options, 1), OK, "");
    EXPECT(tetmill_options_set(options, "order", rank == 1 ? "2" : "1"), OK, "");
    if (size > 1)
        EXPECT(tetmill_generate_comm(ball, options, MPI_COMM_WORLD, 0, &mesh), INPUT, "rank 0: order");
    EXPECT(tetmill_options_set(options, "order", NULL), OK, "");
    EXPECT(tetmill_options_set(options, "allow-off-surface", rank == 1 ? "true" : "false"), OK, "");
    if (size > 1)
        EXPECT(tetmill_generate_comm(ball, options, MPI_COMM_WORLD, 0, &mesh), INPUT, "rank 0: allow_off_surface");
    EXPECT(tetmill_options_set(options, "allow-off-surface", NULL), OK, "");
    EXPECT(tetmill_options_set_size(options, negative, NULL), OK, "");
    EXPECT(tetmill_generate_comm(ball, options, MPI_COMM_WORLD, 0, &mesh), INPUT, "the size function returned -1");
    EXPECT(tetmill_options_set_size(options, NULL, NULL), OK, "");
    EXPECT(tetmill_options_set(options, "mesh-size-file", "no such file"), OK, "");
    EXPECT(tetmill_generate_comm(ball, options, MPI_COMM_WORLD, 0, &mesh), INPUT, "no such file");
    EXPECT(tetmill_options_set(options, "mesh-size-file", NULL), OK, "");
    /* On a part of the world, and on each process alone, which stay usable. */
    MPI_Comm_split(MPI_COMM_WORLD, rank % 2, rank, &half);
    EXPECT(tetmill_geometry_from_text(BALL, &own), OK, "");
    for (int k = 0; k < 2; ++k) {
        EXPECT(tetmill_generate_comm(own, options, half, 0, &mesh), OK, "");
        tetmill_mesh_free(mesh);
    }
    MPI_Comm_free(&half);
    EXPECT(tetmill_generate_comm(own, options, MPI_COMM_SELF, 0, &mesh), OK, "");
    tetmill_mesh_free(mesh);
    tetmill_geometry_free(own);
    EXPECT(tetmill_generate_comm(ball, options, MPI_COMM_WORLD, 0, &mesh), OK, "");
    write_text(mesh, argv[1]);
    tetmill_mesh_free(mesh);
    /* A mesh may be freed after MPI is finalised. */
    EXPECT(tetmill_generate_comm(ball, options, MPI_COMM_WORLD, (unsigned)(2 * size), &mesh), OK, "");
    MPI_Allreduce(MPI_IN_PLACE, &failures, 1, MPI_INT, MPI_SUM, MPI_COMM_WORLD);
    MPI_Finalize();
    tetmill_mesh_free(mesh);
    tetmill_options_free(options);
    tetmill_geometry_free(ball);
    return failures != 0;
}
