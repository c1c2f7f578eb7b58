#include "bindings.hpp"

void bind_normals(py::module_&) {}
