# `make package`: a Debian package of what `cmake --install` installs; its dependencies are read off the binaries.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME tiltrim)
set(CPACK_PACKAGE_CONTACT "The tiltrim authors <tiltrim@example.com>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "trim and linear stability of flight-dynamics models")
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION
"tiltrim finds equilibria of a flight-dynamics model, linearizes it, maps its
eigenvalues over any parameters, tunes gains for the worst of many operating
points and simulates it. Every answer is verified and comes with an error
bound or estimate; if there is no trim, tiltrim gives the reason. A tiltrotor
under total energy control is built in. This package has the program, the
C++ library and its headers.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "gnuplot-nox")
# What a program that is linked with the static libraries needs.
set(CPACK_DEBIAN_PACKAGE_SUGGESTS
    "cmake, g++, libeigen3-dev, coinor-libipopt-dev, libnlopt-dev, libnlopt-cxx-dev, libnetcdf-dev, libmatio-dev, libfmt-dev, libtomlplusplus-dev, libtbb-dev, liblapack-dev, libblas-dev")
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/package)

# Debian's own files: copyright and changelog, compressed without a time so that a package has the same bytes.
file(READ LICENSE license)
string(REGEX REPLACE "\n\n" "\n.\n" license "${license}")
string(REGEX REPLACE "\n([^\n])" "\n \\1" license "${license}")
file(WRITE ${PROJECT_BINARY_DIR}/debian/copyright
"Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/\nUpstream-Name: tiltrim\n
Files: *\nCopyright: 2026 the tiltrim authors\nLicense: Expat\n ${license}")
file(WRITE ${PROJECT_BINARY_DIR}/debian/changelog
"tiltrim (${PROJECT_VERSION}) unstable; urgency=low\n\n  * See CHANGELOG.md.\n
 -- ${CPACK_PACKAGE_CONTACT}  Mon, 23 Nov 2026 00:00:00 +0000\n")
execute_process(COMMAND gzip -9nkf ${PROJECT_BINARY_DIR}/debian/changelog)
install(FILES ${PROJECT_BINARY_DIR}/debian/copyright ${PROJECT_BINARY_DIR}/debian/changelog.gz
        DESTINATION ${CMAKE_INSTALL_DOCDIR})
include(CPack)
