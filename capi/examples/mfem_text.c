/* Writes a mesh as MFEM's parallel text: NAME.000000, NAME.000001, ..., one file for each part.
 *
 *     cc mfem_text.c $(pkg-config --cflags --libs tetmill) -o mfem_text && ./mfem_text part.geo 4 NAME
 *
 * A C++ program with MFEM needs no file: after tetmill_generate_comm, each rank gives its text to
 *     std::istringstream stream(std::string(text, length));
 *     mfem::ParMesh mesh(MPI_COMM_WORLD, stream); */
#include <stdio.h>
#include <stdlib.h>
#include <tetmill.h>

static void check(tetmill_status status) {
    if (status != TETMILL_STATUS_OK) {
        fprintf(stderr, "mfem_text: %s\n", tetmill_last_error());
        exit((int)status);
    }
}

static void write_part(const tetmill_part *part, const char *name) {
    const char *text;
    size_t length;
    uint32_t rank;
    char path[4096];
    FILE *file;
    check(tetmill_part_rank(part, &rank));
    check(tetmill_part_mfem(part, &text, &length));
    snprintf(path, sizeof path, "%s.%06u", name, (unsigned)rank);
    file = fopen(path, "wb");
    if (!file || fwrite(text, 1, length, file) != length || fclose(file)) {
        perror(path);
        exit(TETMILL_STATUS_RESOURCES);
    }
}

int main(int argc, char **argv) {
    tetmill_geometry *geometry;
    tetmill_options *options;
    tetmill_mesh *mesh;
    size_t count;
    if (argc != 4) {
        fputs("usage: mfem_text GEOMETRY PARTS NAME\n", stderr);
        return TETMILL_STATUS_USAGE;
    }
    check(tetmill_geometry_from_file(argv[1], NULL, &geometry));
    check(tetmill_options_new(&options));
    check(tetmill_options_set(options, "levels", "1"));
    check(tetmill_generate(geometry, options, (unsigned)atoi(argv[2]), &mesh));
    check(tetmill_mesh_make_mfem(mesh));
    check(tetmill_mesh_part_count(mesh, &count));
    for (size_t k = 0; k < count; ++k) {
        const tetmill_part *part;
        check(tetmill_mesh_part(mesh, k, &part));
        write_part(part, argv[3]);
    }
    tetmill_mesh_free(mesh);
    tetmill_options_free(options);
    tetmill_geometry_free(geometry);
    return 0;
}
