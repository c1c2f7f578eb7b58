# How each C++ dependency is found. Nothing is downloaded: see third_party/README.md.

# Eigen: the system's, or the one that the PyPI package cmeel-eigen puts into a Python environment.
if(NOT TARGET Eigen3::Eigen)
  find_package(Eigen3 3.3 QUIET NO_MODULE)
  if(NOT Eigen3_FOUND)
    find_package(Python3 QUIET COMPONENTS Interpreter)
    if(Python3_FOUND)
      execute_process(
        COMMAND "${Python3_EXECUTABLE}" -c
                "import importlib.metadata as m; print(m.distribution('cmeel-eigen').locate_file('cmeel.prefix'))"
        OUTPUT_VARIABLE nacre_cmeel_prefix OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    endif()
    find_package(Eigen3 3.3 QUIET NO_MODULE PATHS "${nacre_cmeel_prefix}")
  endif()
  if(NOT Eigen3_FOUND)
    message(FATAL_ERROR "nacre needs Eigen 3.3 or newer: apt-get install libeigen3-dev, or pip install cmeel-eigen, "
                        "or set Eigen3_DIR to the folder of its Eigen3Config.cmake.")
  endif()
endif()

if(NACRE_USE_OPENMP)
  find_package(OpenMP QUIET COMPONENTS CXX)
  if(NOT OpenMP_CXX_FOUND)
    message(STATUS "nacre: no OpenMP found, building for one thread")
  endif()
endif()
