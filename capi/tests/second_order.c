/* A ball of second order in one part and several: all nodes of the boundary lie on the sphere, and
 * the volume by the quadratic map of each tet is the mesh's, by its triangles too. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <tetmill.h>

static int failures;

/* Prints the line of a condition that does not hold, and goes on. */
#define EXPECT(condition) \
    do { \
        if (!(condition)) { \
            fprintf(stderr, "line %d: " #condition " (%s)\n", __LINE__, tetmill_last_error()); \
            ++failures; \
        } \
    } while (0)
#define OK(call) EXPECT((call) == TETMILL_STATUS_OK)

static const char *BALL = "algebraic3d solid b = sphere (0, 0, 0; 1) -bcname=wall; tlo b;";
static const double PI = 3.14159265358979323846;

/* Ends of the edges of tets and triangles, in the order of the nodes on them. */
static const int TET_EDGES[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
static const int TRIANGLE_EDGES[3][2] = {{0, 1}, {1, 2}, {2, 0}};

/* The derivatives of a quadratic element's place by all but the first of its barycentric
 * coordinates, at a point with the given ones: corners have functions l (2 l - 1), edges 4 l m. */
static void derivatives(const double *xyz, const uint32_t *nodes, int corners, int edges, const int ends[][2], const double *l,
                        double out[3][3]) {
    double by[4][3] = {{0}};
    for (int i = 0; i < corners; ++i)
        for (int c = 0; c < 3; ++c)
            by[i][c] += (4 * l[i] - 1) * xyz[3 * nodes[i] + c];
    for (int e = 0; e < edges; ++e)
        for (int c = 0; c < 3; ++c) {
            const double x = xyz[3 * nodes[corners + e] + c];
            by[ends[e][0]][c] += 4 * l[ends[e][1]] * x;
            by[ends[e][1]][c] += 4 * l[ends[e][0]] * x;
        }
    for (int i = 1; i < corners; ++i)
        for (int c = 0; c < 3; ++c)
            out[i - 1][c] = by[i][c] - by[0][c];
}

static double triple(const double *a, const double *b, const double *c) {
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
}

/* The integral of the Jacobian determinant, which has degree 3, by Keast's five points. */
static double tet_volume(const double *xyz, const uint32_t *nodes) {
    static const double center[4] = {0.25, 0.25, 0.25, 0.25};
    double d[3][3], sum;
    derivatives(xyz, nodes, 4, 6, TET_EDGES, center, d);
    sum = -0.8 * triple(d[0], d[1], d[2]);
    for (int k = 0; k < 4; ++k) {
        double l[4] = {1.0 / 6, 1.0 / 6, 1.0 / 6, 1.0 / 6};
        l[k] = 0.5;
        derivatives(xyz, nodes, 4, 6, TET_EDGES, l, d);
        sum += 0.45 * triple(d[0], d[1], d[2]);
    }
    return sum / 6;
}

/* The volume between a curved triangle and the origin: the integral of x . (x_u x x_v) / 3, which
 * has degree 4, by Dunavant's six points. */
static double cone_volume(const double *xyz, const uint32_t *nodes) {
    static const double places[2] = {0.445948490915965, 0.091576213509771};
    static const double weights[2] = {0.223381589678011, 0.109951743655322};
    double sum = 0;
    for (int group = 0; group < 2; ++group)
        for (int k = 0; k < 3; ++k) {
            double l[3] = {places[group], places[group], places[group]}, d[3][3], x[3] = {0};
            l[k] = 1 - 2 * places[group];
            derivatives(xyz, nodes, 3, 3, TRIANGLE_EDGES, l, d);
            for (int c = 0; c < 3; ++c) {
                for (int i = 0; i < 3; ++i)
                    x[c] += l[i] * (2 * l[i] - 1) * xyz[3 * nodes[i] + c];
                for (int e = 0; e < 3; ++e)
                    x[c] += 4 * l[TRIANGLE_EDGES[e][0]] * l[TRIANGLE_EDGES[e][1]] * xyz[3 * nodes[3 + e] + c];
            }
            sum += weights[group] * triple(x, d[0], d[1]);
        }
    return sum / 6;
}

/* The nodes on edges are near the middles of their ends: they are in the order of TET_EDGES or
 * TRIANGLE_EDGES. */
static int are_between(const double *xyz, const uint32_t *nodes, int corners, int edges, const int ends[][2]) {
    for (int e = 0; e < edges; ++e) {
        const double *a = xyz + 3 * nodes[ends[e][0]], *b = xyz + 3 * nodes[ends[e][1]], *m = xyz + 3 * nodes[corners + e];
        double off = 0, length = 0;
        for (int c = 0; c < 3; ++c) {
            off += pow(m[c] - (a[c] + b[c]) / 2, 2);
            length += pow(b[c] - a[c], 2);
        }
        if (off > 0.04 * length)
            return 0;
    }
    return 1;
}

static void curved(const tetmill_geometry *ball, const tetmill_options *options, unsigned parts) {
    tetmill_mesh *mesh;
    uint64_t vertices, tets, triangles, owned = 0, all_tets = 0, on_boundary = 0;
    double volume, angle, by_tets = 0, by_triangles = 0;
    uint32_t order;
    size_t levels;
    OK(tetmill_generate(ball, options, parts, &mesh));
    OK(tetmill_mesh_order(mesh, &order));
    EXPECT(order == 2);
    OK(tetmill_mesh_totals(mesh, &vertices, &tets, &triangles));
    OK(tetmill_mesh_shape(mesh, &volume, &angle));
    for (size_t k = 0; k < parts; ++k) {
        const tetmill_part *part;
        const double *xyz;
        const uint32_t *nodes, *corners, *faces, *face_corners, *owners;
        const int32_t *sides;
        size_t count, points, width;
        OK(tetmill_mesh_part(mesh, k, &part));
        OK(tetmill_part_points(part, &xyz, &points));
        OK(tetmill_part_owners(part, &owners, &count));
        for (size_t v = 0; v < points; ++v)
            owned += owners[v] == k;
        OK(tetmill_part_tets(part, &corners, &count));
        OK(tetmill_part_tet_nodes(part, &nodes, &count, &width));
        EXPECT(width == 10);
        all_tets += count;
        for (size_t t = 0; t < count; ++t) {
            EXPECT(memcmp(nodes + 10 * t, corners + 4 * t, 4 * sizeof *nodes) == 0);
            EXPECT(are_between(xyz, nodes + 10 * t, 4, 6, TET_EDGES));
            by_tets += tet_volume(xyz, nodes + 10 * t);
        }
        OK(tetmill_part_triangles(part, &face_corners, &count));
        OK(tetmill_part_triangle_bodies(part, &sides, &count));
        OK(tetmill_part_triangle_nodes(part, &faces, &count, &width));
        EXPECT(width == 6);
        on_boundary += count;
        for (size_t t = 0; t < count; ++t) {
            EXPECT(memcmp(faces + 6 * t, face_corners + 3 * t, 3 * sizeof *faces) == 0);
            EXPECT(are_between(xyz, faces + 6 * t, 3, 3, TRIANGLE_EDGES));
            EXPECT(sides[2 * t] == 0 && sides[2 * t + 1] == -1);
            by_triangles += cone_volume(xyz, faces + 6 * t);
            for (int i = 0; i < 6; ++i) {
                const double *x = xyz + 3 * faces[6 * t + i];
                EXPECT(fabs(sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]) - 1) < 1e-14);
            }
        }
        /* Levels are those of order 1 only. */
        EXPECT(tetmill_part_level_count(part, &levels) == TETMILL_STATUS_USAGE && strstr(tetmill_last_error(), "order 1"));
        EXPECT(tetmill_part_tet_nodes(part, NULL, &count, &width) == TETMILL_STATUS_USAGE);
        EXPECT(tetmill_part_tet_nodes(part, &nodes, &count, NULL) == TETMILL_STATUS_USAGE);
        EXPECT(tetmill_part_triangle_nodes(NULL, &nodes, &count, &width) == TETMILL_STATUS_USAGE);
    }
    EXPECT(owned == vertices && all_tets == tets && on_boundary == triangles && tets > 100);
    EXPECT(fabs(by_tets - volume) < 1e-12 && fabs(by_triangles - volume) < 1e-12);
    EXPECT(fabs(volume - 4 * PI / 3) < 5e-3);
    printf("%u parts: %llu tets, %llu nodes, volume %.15g by tets, %.15g by triangles, sphere %.15g\n", parts,
           (unsigned long long)tets, (unsigned long long)vertices, by_tets, by_triangles, 4 * PI / 3);
    tetmill_mesh_free(mesh);
}

/* All nodes of order 1 are the corners: the same arrays. */
static void straight(const tetmill_geometry *ball, const tetmill_options *options) {
    tetmill_mesh *mesh;
    const tetmill_part *part;
    const uint32_t *nodes, *corners;
    size_t count, corner_count, width;
    double volume, angle;
    uint32_t order;
    OK(tetmill_generate(ball, options, 1, &mesh));
    OK(tetmill_mesh_order(mesh, &order));
    OK(tetmill_mesh_shape(mesh, &volume, &angle));
    /* Straight edges miss far more of the ball than curved ones. */
    EXPECT(order == 1 && volume < 4 * PI / 3 - 0.1);
    OK(tetmill_mesh_part(mesh, 0, &part));
    OK(tetmill_part_tets(part, &corners, &corner_count));
    OK(tetmill_part_tet_nodes(part, &nodes, &count, &width));
    EXPECT(nodes == corners && count == corner_count && width == 4);
    OK(tetmill_part_triangles(part, &corners, &corner_count));
    OK(tetmill_part_triangle_nodes(part, &nodes, &count, &width));
    EXPECT(nodes == corners && count == corner_count && width == 3);
    EXPECT(tetmill_mesh_order(NULL, &order) == TETMILL_STATUS_USAGE);
    tetmill_mesh_free(mesh);
}

int main(void) {
    tetmill_geometry *ball;
    tetmill_options *options;
    OK(tetmill_set_threads(2));
    OK(tetmill_geometry_from_text(BALL, &ball));
    OK(tetmill_options_new(&options));
    OK(tetmill_options_set(options, "maxh", "0.5"));
    straight(ball, options);
    EXPECT(tetmill_options_set(options, "order", "3") == TETMILL_STATUS_USAGE && strstr(tetmill_last_error(), "1 or 2"));
    OK(tetmill_options_set(options, "order", "2"));
    OK(tetmill_options_set(options, "allow-off-surface", "true"));
    for (unsigned parts = 1; parts <= 5; parts += 2)
        curved(ball, options, parts);
    OK(tetmill_options_set(options, "order", NULL));
    straight(ball, options);
    tetmill_options_free(options);
    tetmill_geometry_free(ball);
    printf("second order: %d failures\n", failures);
    return failures != 0;
}
