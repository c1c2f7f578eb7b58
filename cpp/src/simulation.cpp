#include "nacre/simulation.hpp"
