#include "bindings.hpp"

void bind_simulation(py::module_&) {}
