#include "bindings.hpp"

void bind_model(py::module_&) {}
