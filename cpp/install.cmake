# Everything that a stranger's project needs: find_package(nacre), or pkg-config.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

install(TARGETS nacre EXPORT nacre-targets COMPONENT development
  INCLUDES DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
install(DIRECTORY include/nacre TYPE INCLUDE COMPONENT development FILES_MATCHING PATTERN "*.hpp")

# A static library needs what it is linked with.
set(nacre_find_openmp "")
set(nacre_thread_flags -pthread)
if(NACRE_PARALLEL STREQUAL "openmp" AND NOT BUILD_SHARED_LIBS)
  set(nacre_find_openmp "find_dependency(OpenMP COMPONENTS CXX)")
  string(APPEND nacre_thread_flags " ${OpenMP_CXX_FLAGS}")
endif()

set(nacre_cmake_dir "${CMAKE_INSTALL_LIBDIR}/cmake/nacre")
install(EXPORT nacre-targets NAMESPACE nacre:: DESTINATION "${nacre_cmake_dir}" COMPONENT development)
configure_package_config_file(nacre-config.cmake.in nacre-config.cmake INSTALL_DESTINATION "${nacre_cmake_dir}")
write_basic_package_version_file(nacre-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/nacre-config.cmake" "${CMAKE_CURRENT_BINARY_DIR}/nacre-config-version.cmake"
  DESTINATION "${nacre_cmake_dir}" COMPONENT development)

# pkg-config: paths relative to the .pc file, so that the installed tree can be moved.
cmake_path(ABSOLUTE_PATH CMAKE_INSTALL_LIBDIR BASE_DIRECTORY "${CMAKE_INSTALL_PREFIX}" OUTPUT_VARIABLE nacre_libdir)
file(RELATIVE_PATH nacre_pc_prefix "${nacre_libdir}/pkgconfig" "${CMAKE_INSTALL_PREFIX}")
string(REGEX REPLACE "/$" "" nacre_pc_prefix "${nacre_pc_prefix}")
configure_file(nacre.pc.in nacre.pc @ONLY)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/nacre.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig"
  COMPONENT development)
