# Documentation: `doc` (API pages, where Doxygen is installed) and `reference` (a page of every command).
find_package(Doxygen QUIET)
if(TARGET Doxygen::doxygen)
  configure_file(${PROJECT_SOURCE_DIR}/cmake/Doxyfile.in ${PROJECT_BINARY_DIR}/Doxyfile @ONLY)
  add_custom_target(doc COMMAND Doxygen::doxygen ${PROJECT_BINARY_DIR}/Doxyfile
    WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} COMMENT "API pages in ${PROJECT_BINARY_DIR}/doc/html" VERBATIM)
endif()
if(TARGET tessera_cli)
  file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/doc)
  add_custom_target(reference COMMAND tessera_cli --list-commands:format=markdown > ${PROJECT_BINARY_DIR}/doc/commands.md
    COMMENT "Reference page ${PROJECT_BINARY_DIR}/doc/commands.md" VERBATIM)
endif()
