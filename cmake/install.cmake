# Install rules, and the package that find_package(tessera CONFIG) finds: both kinds of every component.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(TESSERA_PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/tessera)
get_property(TESSERA_COMPONENTS GLOBAL PROPERTY TESSERA_COMPONENTS)
set(static tessera_reference)
set(shared "")
foreach(component IN LISTS TESSERA_COMPONENTS)
  set(target tessera_${component})
  if(component STREQUAL "tessera")
    set(target tessera)
  endif()
  list(APPEND static ${target})
  list(APPEND shared ${target}_shared)
endforeach()
foreach(kind static shared)
  install(TARGETS ${${kind}} EXPORT tesseraTargets-${kind}
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT runtime NAMELINK_COMPONENT development)
  install(EXPORT tesseraTargets-${kind} NAMESPACE tessera:: DESTINATION ${TESSERA_PACKAGE_DIR}
    COMPONENT development)
endforeach()
if(TARGET tessera_cli)
  install(TARGETS tessera_cli RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
  install(PROGRAMS ${PROJECT_SOURCE_DIR}/src/farm/tessera-farm DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
  # The manual page and what shells complete by, made from the registry by the program itself.
  set(made "")
  foreach(file tessera.1 tessera.bash _tessera tessera.fish)
    list(APPEND made ${PROJECT_BINARY_DIR}/shell/${file})
  endforeach()
  add_custom_command(OUTPUT ${made} DEPENDS tessera_cli
    COMMAND ${CMAKE_COMMAND} -E make_directory ${PROJECT_BINARY_DIR}/shell
    COMMAND tessera_cli --man > ${PROJECT_BINARY_DIR}/shell/tessera.1
    COMMAND tessera_cli --completion bash > ${PROJECT_BINARY_DIR}/shell/tessera.bash
    COMMAND tessera_cli --completion zsh > ${PROJECT_BINARY_DIR}/shell/_tessera
    COMMAND tessera_cli --completion fish > ${PROJECT_BINARY_DIR}/shell/tessera.fish
    COMMENT "Manual page and completions" VERBATIM)
  add_custom_target(shell_files ALL DEPENDS ${made})
  set(shell ${PROJECT_BINARY_DIR}/shell)
  install(FILES ${shell}/tessera.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program)
  install(FILES ${shell}/tessera.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
    COMPONENT program RENAME tessera)
  install(FILES ${shell}/_tessera DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT program)
  install(FILES ${shell}/tessera.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT program)
endif()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/tessera ${PROJECT_BINARY_DIR}/include/tessera
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development FILES_MATCHING PATTERN "*.h")
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/tesseraConfig.cmake.in
  ${PROJECT_BINARY_DIR}/tesseraConfig.cmake INSTALL_DESTINATION ${TESSERA_PACKAGE_DIR})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/tesseraConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/tesseraConfig.cmake ${PROJECT_BINARY_DIR}/tesseraConfigVersion.cmake
  ${PROJECT_SOURCE_DIR}/cmake/tesseraRepairs.cmake DESTINATION ${TESSERA_PACKAGE_DIR} COMPONENT development)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/README.md ${PROJECT_SOURCE_DIR}/CHANGELOG.md
  ${PROJECT_SOURCE_DIR}/CITATION.cff DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT documentation)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/doc/ DESTINATION ${CMAKE_INSTALL_DOCDIR}/doc COMPONENT documentation
  FILES_MATCHING PATTERN "*.md" PATTERN "*.png" PATTERN "*.jpg" PATTERN "*.svg")

# For pkg-config: the shared libraries.
list(TRANSFORM TESSERA_COMPONENTS PREPEND -ltessera_ OUTPUT_VARIABLE TESSERA_LIBRARIES)
list(REMOVE_ITEM TESSERA_LIBRARIES -ltessera_tessera -ltessera_verify)
list(JOIN TESSERA_LIBRARIES " " TESSERA_LIBRARIES)
configure_file(${PROJECT_SOURCE_DIR}/cmake/tessera.pc.in ${PROJECT_BINARY_DIR}/tessera.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/tessera.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
include(${CMAKE_CURRENT_LIST_DIR}/package.cmake)
