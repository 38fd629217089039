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

# Installed headers include each other as <tiltrim/model/model.hpp>: then -I <prefix>/include is enough.
install(SCRIPT cmake/installed_headers.cmake)

# pkg-config: static libraries, in one group because they use each other.
get_property(modules GLOBAL PROPERTY TILTRIM_MODULES)
list(TRANSFORM modules PREPEND -ltiltrim_)
list(JOIN modules " " pc_libraries)
set(pc_arb "")
if(TILTRIM_ARB AND TILTRIM_FLINT)
  set(pc_arb " -lflint-arb -lflint")
endif()
# From <prefix>/lib/x86_64-linux-gnu/pkgconfig up to <prefix>.
string(REGEX REPLACE "[^/]+" ".." PC_UP ${CMAKE_INSTALL_LIBDIR})
configure_file(cmake/tiltrim.pc.in tiltrim.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/tiltrim.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
install(FILES LICENSE CITATION.cff README.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY docs examples DESTINATION ${CMAKE_INSTALL_DOCDIR})  # README.md links to them
