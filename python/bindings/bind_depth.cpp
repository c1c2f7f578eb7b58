#include "bindings.hpp"

void bind_depth(py::module_&) {}
