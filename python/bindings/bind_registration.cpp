#include "bindings.hpp"

void bind_registration(py::module_&) {}
