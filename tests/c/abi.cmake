# The shared library's binary interface as libabigail describes it.
#   MODE=write     writes BASE
#   MODE=compare   fails where a program linked with BASE would not run with LIBRARY; functions that were added are fine
#   MODE=removed   the same with a function in BASE that the library has not, and
#   MODE=changed   with a member of a structure at another place: both have to be found
set(now ${WORK}/tessera.${MODE}.abi)
set(describe ${ABIDW} --headers-dir ${HEADERS} --drop-private-types --exported-interfaces-only --no-comp-dir-path
  --no-corpus-path --no-show-locs --no-elf-needed --no-architecture --suppressions ${CMAKE_CURRENT_LIST_DIR}/abi.ini)
if(MODE STREQUAL "write")
  execute_process(COMMAND ${describe} --out-file ${BASE} ${LIBRARY} COMMAND_ERROR_IS_FATAL ANY)
  return()
endif()
execute_process(COMMAND ${describe} --out-file ${now} ${LIBRARY} COMMAND_ERROR_IS_FATAL ANY)
set(base ${BASE})
file(READ ${BASE} text)
if(MODE STREQUAL "removed")
  string(REPLACE "tessera_apply" "tessera_gone" planted "${text}")
elseif(MODE STREQUAL "changed")
  string(REGEX REPLACE "layout-offset-in-bits='448'" "layout-offset-in-bits='384'" planted "${text}")
endif()
if(NOT MODE STREQUAL "compare")
  if(planted STREQUAL text)
    message(FATAL_ERROR "nothing was planted: ${BASE} has not what ${MODE} replaces")
  endif()
  set(base ${WORK}/planted.${MODE}.abi)
  file(WRITE ${base} "${planted}")
endif()
execute_process(COMMAND ${ABIDIFF} --no-added-syms --suppressions ${CMAKE_CURRENT_LIST_DIR}/abi_changes.ini ${base} ${now}
  RESULT_VARIABLE result OUTPUT_VARIABLE report ERROR_VARIABLE report)
if(MODE STREQUAL "compare" AND NOT result EQUAL 0)
  message(FATAL_ERROR "the C interface is not what tests/c/tessera.abi has (${result}):\n${report}")
elseif(NOT MODE STREQUAL "compare" AND NOT result GREATER 3)
  message(FATAL_ERROR "what was planted was not found (${result}):\n${report}")
endif()
