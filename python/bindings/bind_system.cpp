#include "bindings.hpp"
#include "nacre/system.hpp"

void bind_system(py::module_& m) {
  m.def("instruction_set", &nacre::instruction_set);
  m.def("default_threads", &nacre::default_threads);
  m.def("parallel_backend", &nacre::parallel_backend);
}
