#include "nacre/normals.hpp"
