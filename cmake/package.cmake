# Debian packages of what is installed: `cmake --preset deb && cmake --build --preset deb && (cd build/deb && cpack)` makes
#   tessera          the program, its manual page and completions; carries the static libraries inside
#   libtessera1      the shared libraries
#   libtessera-dev   headers, static libraries, packages for CMake and pkg-config
#   tessera-doc      the pages of doc/
# tests/install/debian.sh installs them in a bare Debian and tries them.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME tessera)
set(CPACK_PACKAGE_VENDOR "Tessera")
set(CPACK_PACKAGE_CONTACT "Tessera developers <tessera@example.org>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "image operations, fused and run tile by tile")
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL program runtime development documentation)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS OFF)

set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "image operations, fused and run tile by tile
 The command tessera: colour, curves, look-up tables, filters, resampling, noise,
 compositing and volumes on images of film and game sizes, for those who know oiiotool.")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME tessera)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS "tessera-doc, bash-completion, python3, slurm-client")

set(CPACK_COMPONENT_RUNTIME_DESCRIPTION "image operations, fused and run tile by tile: shared libraries")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME libtessera1)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_EXTRA ${PROJECT_BINARY_DIR}/triggers)
file(WRITE ${PROJECT_BINARY_DIR}/triggers "activate-noawait ldconfig\n")

set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "image operations, fused and run tile by tile: for programs of one's own")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libtessera-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
string(CONCAT CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libtessera1 (= ${PROJECT_VERSION}-1), libopenimageio-dev, "
  "libopencolorio-dev, libtbb-dev, libhwy-dev, libopenvdb-dev, libdeflate-dev, libtiff-dev, libjpeg-dev, libopenexr-dev, "
  "libseccomp-dev")

set(CPACK_COMPONENT_DOCUMENTATION_DESCRIPTION "image operations, fused and run tile by tile: documentation")
set(CPACK_DEBIAN_DOCUMENTATION_PACKAGE_NAME tessera-doc)
set(CPACK_DEBIAN_DOCUMENTATION_PACKAGE_SECTION doc)
set(CPACK_DEBIAN_DOCUMENTATION_PACKAGE_ARCHITECTURE all)

# Each with its licence where Debian looks for it.
foreach(package program tessera runtime libtessera1 development libtessera-dev documentation tessera-doc)
  if(package MATCHES "^(program|runtime|development|documentation)$")
    set(component ${package})
  else()
    install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} RENAME copyright
      COMPONENT ${component})
  endif()
endforeach()
include(CPack)
