# How each C++ dependency is found. Nothing is downloaded: see third_party/README.md.
# What is found here is made global, so that a project that adds nacre as a subdirectory can link it from anywhere.

# Eigen: the system's, or the one that the PyPI package cmeel-eigen puts into a Python environment.
if(NOT TARGET Eigen3::Eigen)
  find_package(Eigen3 QUIET NO_MODULE)
  if(NOT TARGET Eigen3::Eigen)
    find_package(Python3 QUIET COMPONENTS Interpreter)
    if(Python3_FOUND)
      execute_process(
        COMMAND "${Python3_EXECUTABLE}" -c
                "import importlib.metadata as m; print(m.distribution('cmeel-eigen').locate_file('cmeel.prefix'))"
        OUTPUT_VARIABLE nacre_cmeel_prefix OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
      find_package(Eigen3 QUIET NO_MODULE PATHS "${nacre_cmeel_prefix}" NO_DEFAULT_PATH)
    endif()
  endif()
  if(NOT TARGET Eigen3::Eigen OR Eigen3_VERSION VERSION_LESS 3.3)
    message(FATAL_ERROR "nacre needs Eigen 3.3 or newer, found '${Eigen3_VERSION}': apt-get install libeigen3-dev, or "
                        "pip install cmeel-eigen, or set Eigen3_DIR to the folder of its Eigen3Config.cmake.")
  endif()
  set_target_properties(Eigen3::Eigen PROPERTIES IMPORTED_GLOBAL ON)
endif()

if(NOT TARGET Threads::Threads)
  set(THREADS_PREFER_PTHREAD_FLAG ON)
  find_package(Threads REQUIRED)
  set_target_properties(Threads::Threads PROPERTIES IMPORTED_GLOBAL ON)
endif()

# What lends threads to loops: OpenMP where the compiler has it; in the Python package nacre's own, see docs/install.md.
if(NOT NACRE_PARALLEL STREQUAL "threads" AND NOT TARGET OpenMP::OpenMP_CXX)
  find_package(OpenMP QUIET COMPONENTS CXX)
  if(TARGET OpenMP::OpenMP_CXX)
    set_target_properties(OpenMP::OpenMP_CXX PROPERTIES IMPORTED_GLOBAL ON)
  endif()
endif()
set(nacre_parallel_default threads)
if(TARGET OpenMP::OpenMP_CXX AND NOT NACRE_BUILD_PYTHON)
  set(nacre_parallel_default openmp)
endif()
set(NACRE_PARALLEL ${nacre_parallel_default} CACHE STRING "What lends threads to loops: openmp or threads (nacre's own)")
set_property(CACHE NACRE_PARALLEL PROPERTY STRINGS openmp threads)
if(NOT NACRE_PARALLEL MATCHES "^(openmp|threads)$")
  message(FATAL_ERROR "NACRE_PARALLEL must be openmp or threads, got '${NACRE_PARALLEL}'.")
elseif(NACRE_PARALLEL STREQUAL "openmp" AND NOT TARGET OpenMP::OpenMP_CXX)
  message(FATAL_ERROR "NACRE_PARALLEL=openmp, and the compiler has no OpenMP: install it, or set NACRE_PARALLEL=threads.")
endif()
