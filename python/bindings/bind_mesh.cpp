#include "bindings.hpp"

void bind_mesh(py::module_&) {}
