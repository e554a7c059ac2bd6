# Installation: the library, the program, the files for programs and plugins, and the documents, each a component of its own,
# which becomes a package.
include(CMakePackageConfigHelpers)

# library: libstrobe, and the library for images, which it finds in the folder strobe beside itself
install(TARGETS libstrobe EXPORT strobeTargets LIBRARY COMPONENT library NAMELINK_COMPONENT development)
install(TARGETS strobe_images LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/strobe COMPONENT library)

# program
install(TARGETS strobe RUNTIME COMPONENT program)
install(FILES ${shell_files}/strobe.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program)
install(FILES ${shell_files}/strobe.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME strobe
  COMPONENT program)
install(FILES ${shell_files}/_strobe DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions COMPONENT program)
install(FILES ${shell_files}/strobe.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT program)
install(FILES cmake/io.github.strobe.metainfo.xml DESTINATION ${CMAKE_INSTALL_DATADIR}/metainfo COMPONENT program)

# strobe-farm, whose modules it finds in ../share/strobe
install(PROGRAMS tools/farm DESTINATION ${CMAKE_INSTALL_BINDIR} RENAME strobe-farm COMPONENT program)
install(DIRECTORY tools/strobe_farm DESTINATION ${CMAKE_INSTALL_DATADIR}/strobe COMPONENT program FILES_MATCHING PATTERN "*.py")

# development: headers and the CMake package
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/strobe)
install(DIRECTORY ${public_include}/strobe DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)
install(EXPORT strobeTargets NAMESPACE strobe:: DESTINATION ${package_folder} COMPONENT development)
configure_package_config_file(cmake/strobeConfig.cmake.in ${CMAKE_BINARY_DIR}/strobeConfig.cmake
  INSTALL_DESTINATION ${package_folder} PATH_VARS CMAKE_INSTALL_BINDIR)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/strobeConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/strobeConfig.cmake ${CMAKE_BINARY_DIR}/strobeConfigVersion.cmake
  DESTINATION ${package_folder} COMPONENT development)

# documentation: pages and examples
install(FILES README.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT documentation)
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT documentation FILES_MATCHING PATTERN "*.md"
  PATTERN results EXCLUDE PATTERN images EXCLUDE)
install(DIRECTORY examples scenes/lessons DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT documentation)

add_custom_target(uninstall COMMAND ${CMAKE_COMMAND} -DMANIFEST=${CMAKE_BINARY_DIR}/install_manifest.txt
  -P ${CMAKE_SOURCE_DIR}/cmake/uninstall.cmake VERBATIM)
