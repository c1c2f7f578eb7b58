#include "nacre/mesh.hpp"
