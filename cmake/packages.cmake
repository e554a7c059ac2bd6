# Packages of Debian, one per component, and the archive of the sources: tools/make-packages configures with STROBE_PACKAGES.
option(STROBE_PACKAGES "Prepare the packages of tools/make-packages" OFF)
if(NOT STROBE_PACKAGES)
  return()
endif()

set(library_package libstrobe${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
set(package_of_library ${library_package})
set(package_of_program strobe)
set(package_of_development libstrobe-dev)
set(package_of_documentation strobe-doc)
set(maintainer "the strobe maintainers <maintainers@strobe.example>")

# Files that Debian's policy asks for: copyright, and a changelog of the package, compressed without times.
set(policy ${CMAKE_BINARY_DIR}/policy)
file(READ LICENSE license)
string(REGEX MATCH "Copyright [^\n]*" copyright "${license}")
string(REGEX REPLACE "\n\n" "\n.\n" license "${license}")
string(REGEX REPLACE "\n" "\n " license " ${license}")
string(REGEX REPLACE "\n +$" "" license "${license}")
string(TIMESTAMP date "%Y-%m-%d" UTC)
execute_process(COMMAND date -u -R -d ${date} OUTPUT_VARIABLE date OUTPUT_STRIP_TRAILING_WHITESPACE)
file(WRITE ${policy}/copyright "Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Upstream-Name: strobe

Files: *
Copyright: ${copyright}
License: BSD-3-Clause
${license}
")
foreach(component library program development documentation)
  set(package ${package_of_${component}})
  file(WRITE ${policy}/${component}/changelog "strobe (${PROJECT_VERSION}) unstable; urgency=medium

  * CHANGELOG.md of the package strobe-doc has the changes.

 -- ${maintainer}  ${date}
")
  execute_process(COMMAND gzip -9nf ${policy}/${component}/changelog)
  install(FILES ${policy}/copyright ${policy}/${component}/changelog.gz DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package}
    COMPONENT ${component})
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${package})
endforeach()
# The manual page is compressed, and libraries are found in the folder of the system.
install(CODE "execute_process(COMMAND gzip -9nf \$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_MANDIR}/man1/strobe.1)"
  COMPONENT program)
set_target_properties(strobe PROPERTIES INSTALL_RPATH "")

set(CPACK_PACKAGE_NAME strobe)
set(CPACK_PACKAGE_VENDOR "the strobe maintainers")
set(CPACK_PACKAGE_CONTACT "${maintainer}")
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_DIRECTORY ${CMAKE_BINARY_DIR}/packages)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ
  WORLD_EXECUTE)
set(CPACK_GENERATOR DEB)
set(CPACK_COMPONENTS_ALL library program development documentation)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${CMAKE_BINARY_DIR})
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DOCUMENTATION_PACKAGE_SECTION doc)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_DOCUMENTATION_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_DOCUMENTATION_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS "${library_package} (= ${PROJECT_VERSION}), python3")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "${library_package} (= ${PROJECT_VERSION}), libimath-dev")
file(WRITE ${policy}/triggers "activate-noawait ldconfig\n")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA ${policy}/triggers)
set(about "strobe is a physically based renderer in the style of pbrt that decouples
shading from visibility: an integrator, chosen by a flag, decides how many
visibility samples share one evaluation of shading. It reads scenes of pbrt
and animated glTF 2.0.")
foreach(entry "LIBRARY;renderer with decoupled shading, library;the library" "PROGRAM;renderer with decoupled shading;the program"
    "DEVELOPMENT;renderer with decoupled shading, development files;the headers and the CMake package for plugins and programs"
    "DOCUMENTATION;renderer with decoupled shading, documentation;the documentation and examples")
  list(GET entry 0 component)
  list(GET entry 1 summary)
  list(GET entry 2 content)
  set(CPACK_COMPONENT_${component}_DESCRIPTION "${summary}\n${about}\n\nThis package has ${content}.")
endforeach()
include(CPack)
