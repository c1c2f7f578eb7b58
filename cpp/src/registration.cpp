#include "nacre/registration.hpp"
