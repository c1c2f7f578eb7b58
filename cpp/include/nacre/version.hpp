#pragma once

/// The one place where the version is written: CMake and the Python build read it from here.
#define NACRE_VERSION "0.1.0"
