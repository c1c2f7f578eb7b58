#include "nacre/kdtree.hpp"
