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

# `book`: a page for every command, with lines that run and what they made. Its test builds it small and looks for dead
# links; whoever adds a command is told there to add a line to doc/book/lines.txt.
find_package(Python3 COMPONENTS Interpreter QUIET)
if(TARGET tessera_cli AND TARGET scene AND Python3_FOUND)
  add_custom_target(book COMMAND Python3::Interpreter -B ${PROJECT_SOURCE_DIR}/doc/book/build.py
    --tool $<TARGET_FILE:tessera_cli> --scene $<TARGET_FILE:scene> --doxygen ${PROJECT_BINARY_DIR}/doc/html
    --out ${PROJECT_BINARY_DIR}/doc/book COMMENT "The book in ${PROJECT_BINARY_DIR}/doc/book" VERBATIM)
  add_dependencies(book tessera_cli scene)
  if(TESSERA_TESTS AND NOT TESSERA_SANITIZE)
    add_test(NAME doc.Book COMMAND Python3::Interpreter -B ${PROJECT_SOURCE_DIR}/tests/doc/book_test.py
      $<TARGET_FILE:tessera_cli> $<TARGET_FILE:scene> ${PROJECT_BINARY_DIR}/doc/book_test)
    set_tests_properties(doc.Book PROPERTIES TIMEOUT 900 PROCESSORS 2 SKIP_RETURN_CODE 77)
    add_test(NAME doc.Techniques COMMAND Python3::Interpreter -B ${PROJECT_SOURCE_DIR}/tests/doc/techniques_test.py
      $<TARGET_FILE:tessera_cli> $<TARGET_FILE:scene> ${PROJECT_BINARY_DIR}/doc/techniques_test)
    add_test(NAME doc.Gallery COMMAND Python3::Interpreter -B ${PROJECT_SOURCE_DIR}/tests/doc/gallery_test.py
      $<TARGET_FILE:tessera_cli> ${PROJECT_BINARY_DIR}/doc/gallery_test)
    set_tests_properties(doc.Techniques doc.Gallery PROPERTIES TIMEOUT 900 SKIP_RETURN_CODE 77)
  endif()
endif()
