#include "nacre/consolidation.hpp"
