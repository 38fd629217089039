# What `cmake --install` adds to the libraries and the program: find_package(tiltrim), data, studies.
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/tiltrim)

install(EXPORT tiltrim NAMESPACE tiltrim:: FILE tiltrim-targets.cmake DESTINATION ${package_dir})
configure_package_config_file(cmake/tiltrim-config.cmake.in tiltrim-config.cmake
                              INSTALL_DESTINATION ${package_dir})
# While the version is 0.x a minor one may break what is public (docs/api.md).
set(compatible SameMajorVersion)
if(PROJECT_VERSION_MAJOR EQUAL 0)
  set(compatible SameMinorVersion)
endif()
write_basic_package_version_file(tiltrim-config-version.cmake COMPATIBILITY ${compatible})
install(FILES ${PROJECT_BINARY_DIR}/tiltrim-config.cmake
              ${PROJECT_BINARY_DIR}/tiltrim-config-version.cmake DESTINATION ${package_dir})
install(DIRECTORY data studies DESTINATION ${CMAKE_INSTALL_DATADIR}/tiltrim)
