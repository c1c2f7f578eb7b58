#include "nacre/depth.hpp"
