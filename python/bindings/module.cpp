// The table of contents of the extension module; each part is bound in a file of its own, bottom layer first.
#include "bindings.hpp"

PYBIND11_MODULE(_core, m) {
  m.doc() = "The C++ core of nacre; use it through the nacre package.";
  m.attr("__version__") = NACRE_VERSION;
  bind_system(m);
  bind_camera(m);
  bind_cubes(m);
  bind_depth(m);
  bind_kdtree(m);
  bind_normals(m);
  bind_region(m);
  bind_registration(m);
  bind_consolidation(m);
  bind_mesh(m);
  bind_simulation(m);
  bind_rendering(m);
  bind_model(m);
}
