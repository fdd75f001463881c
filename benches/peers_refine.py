#!/usr/bin/env python3
"""MFEM's uniform refinement of the cube of `cargo bench --bench refine -- cube 12 8`, with the same columns.

  pip install mfem                   # in a separate environment
  peers_refine.py [LEVELS]           # 82 944 tets, times eight at each level; three levels take 12 GB

Times are processor times of the last level only. The meshes are stored, not snapped, and no tet is checked.
"""
import resource
import sys
import time

import mfem.ser as mfem

levels = int(sys.argv[1]) if len(sys.argv) > 1 else 3
mesh = mfem.Mesh.MakeCartesian3D(24, 24, 24, mfem.Element.TETRAHEDRON)
print("| program | tets | s of the last level | M tets/cpu s | peak MB | bytes/tet |")
print("|---|---|---|---|---|---|")
for level in range(1, levels + 1):
    began = time.process_time()
    mesh.UniformRefinement()
    took = time.process_time() - began
    tets = mesh.GetNE()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    print(f"| MFEM {mfem.__version__ if hasattr(mfem, '__version__') else ''} | {tets} | {took:.2f} | {tets / took / 1e6:.2f} | {peak / 1e6:.0f} | {peak / tets:.0f} |")
