#include "bindings.hpp"

void bind_kdtree(py::module_&) {}
