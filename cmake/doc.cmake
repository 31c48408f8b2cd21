# Documentation: `doc` (API pages, where Doxygen is installed) and `reference` (a page of every command).
find_package(Doxygen QUIET)
file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/doc)  # two of Doxygen's runs at a time would race to make it
if(TARGET Doxygen::doxygen)
  configure_file(${PROJECT_SOURCE_DIR}/cmake/Doxyfile.in ${PROJECT_BINARY_DIR}/Doxyfile @ONLY)
  add_custom_target(doc COMMAND Doxygen::doxygen ${PROJECT_BINARY_DIR}/Doxyfile
    WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} COMMENT "API pages in ${PROJECT_BINARY_DIR}/doc/html" VERBATIM)
  if(TESSERA_TESTS)
    # An undocumented public declaration fails, and a planted one proves that it would.
    file(READ ${PROJECT_BINARY_DIR}/Doxyfile settings)
    string(APPEND settings "GENERATE_HTML = NO\nGENERATE_XML = YES\nXML_OUTPUT = check\nWARN_AS_ERROR = FAIL_ON_WARNINGS\n")
    file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/Doxyfile.check CONTENT "${settings}" @ONLY)
    file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/Doxyfile.planted CONTENT
      "${settings}INPUT = tests/house/undocumented.h\nUSE_MDFILE_AS_MAINPAGE =\n" @ONLY)
    add_test(NAME doc.PublicDeclarationsAreDocumented COMMAND Doxygen::doxygen ${PROJECT_BINARY_DIR}/Doxyfile.check
      WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
    add_test(NAME doc.UndocumentedOnesAreFound COMMAND Doxygen::doxygen ${PROJECT_BINARY_DIR}/Doxyfile.planted
      WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
    set_tests_properties(doc.UndocumentedOnesAreFound PROPERTIES PASS_REGULAR_EXPRESSION
      "undocumented.h:[0-9]+: .*Planted.*is not documented")
  endif()
endif()
if(TARGET tessera_cli)
  add_custom_target(reference COMMAND tessera_cli --list-commands:format=markdown > ${PROJECT_BINARY_DIR}/doc/commands.md
    COMMENT "Reference page ${PROJECT_BINARY_DIR}/doc/commands.md" VERBATIM)
endif()
