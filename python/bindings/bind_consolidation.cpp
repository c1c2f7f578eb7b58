#include "bindings.hpp"

void bind_consolidation(py::module_&) {}
