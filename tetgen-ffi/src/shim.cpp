// C interface of TetGen's tetrahedralize(), with plain arrays.

#include <cstdio>
#include <cstring>
#include <new>
#include <string>

#include "tetgen.h"

extern "C" {

// The result. The arrays belong to `owner` and live until shim_free().
struct ShimMesh {
  int points;
  const double *coordinates;
  int tets;
  int corners;
  const int *vertices;
  int attributes;
  const double *regions;
  void *owner;
};

// Returns 0 for a mesh, the code that TetGen threw, or -1 for any other exception.
int shim_run(const char *switches, int points, const double *coordinates, int facets, const int *triangles,
             ShimMesh *mesh) {
  int status = 0;
  tetgenio *out = new tetgenio;
  try {
    tetgenio in;
    in.numberofpoints = points;
    in.pointlist = new REAL[3 * points];
    std::memcpy(in.pointlist, coordinates, sizeof(REAL) * 3 * points);
    in.numberoffacets = facets;
    in.facetlist = facets > 0 ? new tetgenio::facet[facets] : NULL;
    for (int i = 0; i < facets; i++) {
      tetgenio::facet &facet = in.facetlist[i];
      tetgenio::init(&facet);
      facet.numberofpolygons = 1;
      facet.polygonlist = new tetgenio::polygon[1];
      facet.polygonlist[0].numberofvertices = 3;
      facet.polygonlist[0].vertexlist = new int[3];
      std::memcpy(facet.polygonlist[0].vertexlist, triangles + 3 * i, sizeof(int) * 3);
    }
    std::string text(switches);
    tetrahedralize(&text[0], &in, out);
  } catch (int thrown) {
    status = thrown != 0 ? thrown : -1;
  } catch (...) {
    status = -1;
  }
  // TetGen's output must precede the worker's answer in the same pipe.
  std::fflush(stdout);
  ShimMesh result = {out->numberofpoints, out->pointlist,
                     out->numberoftetrahedra, out->numberofcorners, out->tetrahedronlist,
                     out->numberoftetrahedronattributes, out->tetrahedronattributelist, out};
  *mesh = result;
  return status;
}

void shim_free(ShimMesh *mesh) {
  delete static_cast<tetgenio *>(mesh->owner);
  mesh->owner = NULL;
}
}
