/* Wrong use of the C interface: each call returns its code and a text, and nothing leaks or crashes. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <tetmill.h>

static int failures;

/* The call returned `expected`, and the text of the error contains `words`. */
static void expect(int line, tetmill_status status, tetmill_status expected, const char *words) {
    const char *text = tetmill_last_error();
    if (status == expected && tetmill_last_status() == expected && strstr(text, words))
        return;
    fprintf(stderr, "line %d: status %d instead of %d, text `%s` instead of `%s`\n", line, status, expected, text, words);
    ++failures;
}

static void succeed(int line, tetmill_status status) {
    if (status == TETMILL_STATUS_OK)
        return;
    fprintf(stderr, "line %d: status %d, %s\n", line, status, tetmill_last_error());
    ++failures;
}

#define EXPECT(call, expected, words) expect(__LINE__, call, TETMILL_STATUS_##expected, words)
#define OK(call) succeed(__LINE__, call)

static const char *BALL = "algebraic3d solid b = sphere (0, 0, 0; 1) -bcname=wall; tlo b;";

static double constant(const double *xyz, void *user) {
    (void)xyz;
    return *(double *)user;
}

static int cancel_in_refine(const char *stage, double fraction, void *user) {
    (void)user;
    return strcmp(stage, "refine") == 0 && fraction > 0.1;
}

static int cancel_at_once(void *user) {
    (void)user;
    return 1;
}

static void geometries(void) {
    tetmill_geometry *g = (tetmill_geometry *)&failures;
    static const double nan_points[9] = {0, 0, 0, 1, 0, 0, 0, NAN, 0};
    static const double points[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    static const uint32_t triangle[3] = {0, 1, 2}, beyond[3] = {0, 1, 3};
    tetmill_surface s = {0};
    tetmill_tets t = {0};
    const char *note;
    EXPECT(tetmill_geometry_from_text(NULL, &g), USAGE, "`text` is a null pointer");
    if (g != NULL)
        ++failures;
    EXPECT(tetmill_geometry_from_text(BALL, NULL), USAGE, "`geometry` is a null pointer");
    EXPECT(tetmill_geometry_from_text("\xff", &g), USAGE, "not UTF-8");
    EXPECT(tetmill_geometry_from_text("algebraic3d solid b = spere (0, 0, 0; 1); tlo b;", &g), INPUT, "sphere");
    EXPECT(tetmill_geometry_from_file("no such file.stl", NULL, &g), INPUT, "no such file.stl");
    EXPECT(tetmill_geometry_from_surface(NULL, NULL, &g), USAGE, "`surface`");
    s.points = nan_points;
    s.point_count = 3;
    s.triangle_count = 1;
    EXPECT(tetmill_geometry_from_surface(&s, NULL, &g), USAGE, "`triangles` is a null pointer");
    s.triangles = triangle;
    EXPECT(tetmill_geometry_from_surface(&s, NULL, &g), INPUT, "point 2");
    s.points = points;
    EXPECT(tetmill_geometry_from_surface(&s, NULL, &g), INPUT, "");
    s.triangles = beyond;
    EXPECT(tetmill_geometry_from_surface(&s, NULL, &g), INPUT, "3");
    s.triangle_count = SIZE_MAX;
    EXPECT(tetmill_geometry_from_surface(&s, NULL, &g), USAGE, "cannot have");
    EXPECT(tetmill_geometry_from_tets(&t, &g), INPUT, "");
    EXPECT(tetmill_geometry_note(NULL, 0, &note), USAGE, "`geometry`");
    tetmill_geometry_free(g);
}

static void options(const tetmill_geometry *ball) {
    tetmill_options *o;
    tetmill_mesh *m;
    static const double origin[3] = {0, 0, 0}, nowhere[3] = {0, INFINITY, 0};
    double wrong[] = {NAN, -1};
    OK(tetmill_options_new(&o));
    EXPECT(tetmill_options_new(NULL), USAGE, "`options`");
    EXPECT(tetmill_options_set(NULL, "levels", "1"), USAGE, "`options`");
    EXPECT(tetmill_options_set(o, NULL, "1"), USAGE, "`name`");
    EXPECT(tetmill_options_set(o, "level", "1"), USAGE, "levels");
    EXPECT(tetmill_options_set(o, "levels", "11"), USAGE, "0 to 10");
    EXPECT(tetmill_options_set(o, "preset", "finest"), USAGE, "very-fine");
    EXPECT(tetmill_options_set(o, "overlap-to", "larger"), USAGE, "first, last or smaller");
    EXPECT(tetmill_options_set_maxh(o, NAN), USAGE, "option maxh cannot be `NaN`");
    EXPECT(tetmill_options_set_maxh(o, -1), USAGE, "positive");
    EXPECT(tetmill_options_set_elements(o, 0), USAGE, "count");
    EXPECT(tetmill_options_add_source(o, nowhere, 1), USAGE, "inf");
    EXPECT(tetmill_options_add_source(o, origin, NAN), USAGE, "NaN");
    EXPECT(tetmill_options_add_plane(o, origin, origin), USAGE, "zero");
    OK(tetmill_options_set(o, "elements", "1e4"));
    OK(tetmill_options_set(o, "levels", "1"));
    EXPECT(tetmill_generate(ball, o, 1, &m), INPUT, "exclude each other");
    OK(tetmill_options_set(o, "elements", NULL));
    OK(tetmill_options_set(o, "maxh", "1e-300"));
    EXPECT(tetmill_generate(ball, o, 1, &m), INPUT, "the option is maxh");
    OK(tetmill_options_set(o, "maxh", NULL));
    for (size_t k = 0; k < 2; ++k)
        for (unsigned parts = 1; parts <= 3; parts += 2) {
            OK(tetmill_options_set_size(o, constant, &wrong[k]));
            EXPECT(tetmill_generate(ball, o, parts, &m), INPUT, "the size function returned");
        }
    OK(tetmill_options_set_size(o, NULL, NULL));
    OK(tetmill_options_set_progress(o, cancel_in_refine, NULL));
    EXPECT(tetmill_generate(ball, o, 2, &m), CANCELLED, "cancelled");
    OK(tetmill_options_set_progress(o, NULL, NULL));
    OK(tetmill_options_set_cancel(o, cancel_at_once, NULL));
    EXPECT(tetmill_generate(ball, o, 1, &m), CANCELLED, "cancelled");
    tetmill_options_free(o);
}

static void meshes(const tetmill_geometry *ball) {
    tetmill_mesh *m;
    const tetmill_part *p;
    const char *name;
    const double *xyz;
    const uint32_t *u;
    const uint64_t *ids;
    uint32_t number, patches[1];
    size_t count, vertices;
    EXPECT(tetmill_generate(NULL, NULL, 1, &m), USAGE, "`geometry`");
    EXPECT(tetmill_generate(ball, NULL, 1, NULL), USAGE, "`mesh`");
    EXPECT(tetmill_generate(ball, NULL, 0, &m), USAGE, "`parts` cannot be 0");
    EXPECT(tetmill_generate(ball, NULL, 100000, &m), USAGE, "8192");
    EXPECT(tetmill_generate(ball, NULL, 1000, &m), INPUT, "parts");
    OK(tetmill_generate(ball, NULL, 2, &m));
    EXPECT(tetmill_mesh_part(NULL, 0, &p), USAGE, "`mesh`");
    EXPECT(tetmill_mesh_part(m, 2, &p), USAGE, "there is no part 2: there are 2");
    EXPECT(tetmill_mesh_patch(m, 1, &number, &name), USAGE, "no patch 1");
    EXPECT(tetmill_mesh_patches_named(m, "wal", patches, 1, &count), INPUT, "did you mean `wall`");
    EXPECT(tetmill_mesh_patches_named(m, "wall", NULL, 1, &count), USAGE, "`patches`");
    OK(tetmill_mesh_patches_named(m, "wall", NULL, 0, &count));
    OK(tetmill_mesh_part(m, 1, &p));
    EXPECT(tetmill_part_points(NULL, &xyz, &count), USAGE, "`part`");
    EXPECT(tetmill_part_points(p, NULL, &count), USAGE, "`xyz`");
    EXPECT(tetmill_part_points(p, &xyz, NULL), USAGE, "`count`");
    EXPECT(tetmill_part_neighbour_vertices(p, 1, &u, &count), USAGE, "no neighbour 1");
    EXPECT(tetmill_part_ghost_vertices(p, TETMILL_BY_FACES, &xyz, &ids, &count), USAGE, "tetmill_mesh_find_ghosts");
    EXPECT(tetmill_mesh_find_ghosts(m, 7), USAGE, "`by` cannot be 7");
    EXPECT(tetmill_part_mfem(p, &name, &count), USAGE, "tetmill_mesh_make_mfem");
    EXPECT(tetmill_mesh_make_mfem(NULL), USAGE, "`mesh`");
    EXPECT(tetmill_mesh_sum(m, NULL), USAGE, "`values`");
    OK(tetmill_part_points(p, &xyz, &vertices));
    {
        double *values = calloc(4 * vertices + 1000, sizeof *values);
        double *same[2] = {values, values}, *null[2] = {values, NULL}, *odd[2];
        odd[0] = values;
        odd[1] = (double *)((char *)values + 8 * vertices + 4004);
        EXPECT(tetmill_mesh_sum(m, same), USAGE, "the same array");
        EXPECT(tetmill_mesh_sum(m, null), USAGE, "`values` is a null pointer");
        EXPECT(tetmill_mesh_sum(m, odd), USAGE, "aligned");
        free(values);
    }
    tetmill_mesh_free(m);
}

/* Ghosts by vertices, and the arrays of all parts together. */
static void right_use(const tetmill_geometry *ball) {
    tetmill_mesh *m;
    uint64_t vertices, tets, triangles, owned = 0, sum_of_tets = 0;
    double volume, angle;
    OK(tetmill_generate(ball, NULL, 3, &m));
    OK(tetmill_mesh_totals(m, &vertices, &tets, &triangles));
    OK(tetmill_mesh_shape(m, &volume, &angle));
    OK(tetmill_mesh_find_ghosts(m, TETMILL_BY_VERTICES));
    for (size_t k = 0; k < 3; ++k) {
        const tetmill_part *p;
        const uint32_t *owners, *shared, *ranks, *ghosts, *bodies, *from;
        const uint64_t *offsets, *ids, *indices;
        const double *xyz;
        size_t count, ghost_vertices, all;
        OK(tetmill_mesh_part(m, k, &p));
        OK(tetmill_part_owners(p, &owners, &all));
        for (size_t v = 0; v < all; ++v)
            owned += owners[v] == k;
        OK(tetmill_part_sharing(p, &shared, &offsets, &ranks, &count));
        for (size_t s = 0; s < count; ++s)
            if (offsets[s + 1] - offsets[s] < 2 || shared[s] >= all)
                ++failures;
        OK(tetmill_part_ghost_vertices(p, TETMILL_BY_VERTICES, &xyz, &ids, &ghost_vertices));
        OK(tetmill_part_ghost_tets(p, TETMILL_BY_VERTICES, &ghosts, &ids, &bodies, &count));
        OK(tetmill_part_ghost_owners(p, TETMILL_BY_VERTICES, &from, &indices, &count));
        if (count == 0)
            ++failures;
        for (size_t t = 0; t < count; ++t)
            for (int i = 0; i < 4; ++i)
                if (ghosts[4 * t + i] >= all + ghost_vertices || from[t] == k)
                    ++failures;
        OK(tetmill_part_tet_ids(p, &ids, &count));
        sum_of_tets += count;
    }
    if (owned != vertices || sum_of_tets != tets || !(volume > 3.5 && volume < 4.189) || !(angle > 10)) {
        fprintf(stderr, "%llu of %llu vertices, volume %g, angle %g\n", (unsigned long long)owned,
                (unsigned long long)vertices, volume, angle);
        ++failures;
    }
    tetmill_mesh_free(m);
}

/* Sizes on the points of one tet. */
static void background(const tetmill_geometry *ball) {
    static const double xyz[12] = {-9, -9, -9, 9, -9, -9, -9, 9, -9, -9, -9, 99};
    static const double sizes[4] = {0.3, 0.3, 0.3, 0.3}, wrong[4] = {0.3, 0.3, -1, 0.3};
    static const uint32_t tet[4] = {0, 1, 2, 3}, beyond[4] = {0, 1, 2, 4};
    tetmill_options *o;
    tetmill_mesh *m;
    uint64_t vertices, triangles, coarse, fine;
    OK(tetmill_options_new(&o));
    OK(tetmill_generate(ball, o, 1, &m));
    OK(tetmill_mesh_totals(m, &vertices, &coarse, &triangles));
    tetmill_mesh_free(m);
    EXPECT(tetmill_options_set_background(NULL, xyz, 4, tet, 1, sizes), USAGE, "`options`");
    EXPECT(tetmill_options_set_background(o, NULL, 4, tet, 1, sizes), USAGE, "`xyz`");
    EXPECT(tetmill_options_set_background(o, xyz, 4, beyond, 1, sizes), INPUT, "point 4 of 4");
    EXPECT(tetmill_options_set_background(o, xyz, 4, tet, 1, wrong), INPUT, "size -1");
    OK(tetmill_options_set_background(o, xyz, 4, tet, 1, sizes));
    OK(tetmill_generate(ball, o, 1, &m));
    OK(tetmill_mesh_totals(m, &vertices, &fine, &triangles));
    tetmill_mesh_free(m);
    if (fine < 2 * coarse) {
        fprintf(stderr, "%llu tets with sizes of 0.3, %llu without\n", (unsigned long long)fine, (unsigned long long)coarse);
        ++failures;
    }
    OK(tetmill_options_set_background(o, NULL, 0, NULL, 0, NULL));
    OK(tetmill_generate(ball, o, 1, &m));
    OK(tetmill_mesh_totals(m, &vertices, &fine, &triangles));
    if (fine != coarse)
        ++failures;
    tetmill_mesh_free(m);
    tetmill_options_free(o);
}

/* Each level interpolates to the next one, and eight children fill each nested tet. */
static void levels(const tetmill_geometry *ball) {
    tetmill_options *o;
    tetmill_mesh *m;
    size_t count;
    OK(tetmill_options_new(&o));
    OK(tetmill_options_set_levels(o, 2));
    OK(tetmill_options_set(o, "nested", "true"));
    OK(tetmill_options_set(o, "maxh", "0.5"));
    OK(tetmill_generate(ball, o, 2, &m));
    for (size_t k = 0; k < 2; ++k) {
        const tetmill_part *p, *level, *before = NULL;
        OK(tetmill_mesh_part(m, k, &p));
        OK(tetmill_part_level_count(p, &count));
        if (count != 3)
            ++failures;
        for (size_t l = 0; l < 3; ++l, before = level) {
            const double *x, *y;
            const uint32_t *parents, *tets, *owners;
            const uint64_t *parent_tets;
            size_t points, coarse_points, fine, coarse;
            OK(tetmill_part_level(p, l, &level));
            OK(tetmill_part_points(level, &x, &points));
            OK(tetmill_part_tets(level, &tets, &fine));
            OK(tetmill_part_owners(level, &owners, &count));
            if (count != points)
                ++failures;
            if (l == 0) {
                EXPECT(tetmill_level_vertex_parents(level, &parents, &count), USAGE, "coarsest");
                continue;
            }
            OK(tetmill_part_points(before, &y, &coarse_points));
            OK(tetmill_part_tets(before, &tets, &coarse));
            OK(tetmill_level_vertex_parents(level, &parents, &count));
            if (count != points)
                ++failures;
            for (size_t v = 0; v < points; ++v)
                for (int i = 0; i < 3; ++i) {
                    const uint32_t a = parents[2 * v], b = parents[2 * v + 1];
                    if (a >= coarse_points || b >= coarse_points || fabs((y[3 * a + i] + y[3 * b + i]) / 2 - x[3 * v + i]) > 0.1)
                        ++failures;
                }
            OK(tetmill_level_tet_parents(level, &parent_tets, &count));
            if (count != fine || fine != 8 * coarse || parent_tets[count - 1] >= coarse)
                ++failures;
        }
        EXPECT(tetmill_part_level(p, 3, &level), USAGE, "level 3");
        EXPECT(tetmill_level_vertex_parents(p, NULL, &count), USAGE, "coarsest");
        OK(tetmill_part_level(p, 1, &level));
        EXPECT(tetmill_part_level_count(level, &count), USAGE, "is a level");
    }
    tetmill_mesh_free(m);
    OK(tetmill_options_set(o, "levels", NULL));
    OK(tetmill_options_set(o, "nested", NULL));
    OK(tetmill_options_set(o, "method", "surface"));
    OK(tetmill_generate(ball, o, 1, &m));
    {
        const tetmill_part *p;
        OK(tetmill_mesh_part(m, 0, &p));
        EXPECT(tetmill_part_level_count(p, &count), USAGE, "refine");
    }
    tetmill_mesh_free(m);
    tetmill_options_free(o);
}

int main(void) {
    tetmill_geometry *ball;
    if (tetmill_last_status() != TETMILL_STATUS_OK || *tetmill_last_error())
        ++failures;
    OK(tetmill_set_threads(2));
    EXPECT(tetmill_set_threads(2), USAGE, "number of threads");
    OK(tetmill_geometry_from_text(BALL, &ball));
    geometries();
    options(ball);
    meshes(ball);
    right_use(ball);
    levels(ball);
    background(ball);
    tetmill_geometry_free(ball);
    tetmill_geometry_free(NULL);
    tetmill_options_free(NULL);
    tetmill_mesh_free(NULL);
    printf("tetmill %s, %d failures\n", tetmill_version(), failures);
    return failures != 0;
}
