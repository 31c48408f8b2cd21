# What the library is made of. tessera_component(io) defines the static library tessera_io, which tests and programs of
# this tree link, and tessera_io_shared, a shared one of the same objects; tessera::io is the one that BUILD_SHARED_LIBS
# asks for. Without a name it is the library of all of them, tessera.
#   PUBLIC, PRIVATE   libraries outside the tree that it needs
#   ON                components below it, of which both kinds need their own
#   ABI               the number in the shared library's name; versions of one number may be exchanged
# What is compiled for it: target_sources(tessera_io PRIVATE ...).
include(CheckLinkerFlag)
check_linker_flag(CXX LINKER:-Bsymbolic-functions TESSERA_BSYMBOLIC)
check_linker_flag(CXX LINKER:--no-as-needed TESSERA_NO_AS_NEEDED)
function(tessera_component)
  cmake_parse_arguments(PARSE_ARGV 0 arg "" "ABI" "PUBLIC;PRIVATE;ON")
  list(GET arg_UNPARSED_ARGUMENTS 0 component)
  set(target tessera_${component})
  if(component STREQUAL "tessera")
    set(target tessera)
  endif()
  if(NOT arg_ABI)
    set(arg_ABI ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  endif()
  # A program of each test with all of a sanitizer's code in it would fill a disk: there, tests link a shared one as well.
  if(TESSERA_SANITIZE)
    add_library(${target} SHARED)
  else()
    add_library(${target} STATIC)
  endif()
  add_library(${target}_shared SHARED $<TARGET_OBJECTS:${target}>)
  foreach(kind "" _shared)
    set(library ${target}${kind})
    set_target_properties(${library} PROPERTIES OUTPUT_NAME ${target} EXPORT_NAME ${component})
    target_compile_features(${library} PUBLIC cxx_std_20)
    target_include_directories(${library} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
      $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/include> $<INSTALL_INTERFACE:include>)
    target_link_libraries(${library} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE})
    foreach(below IN LISTS arg_ON)
      target_link_libraries(${library} PUBLIC tessera_${below}${kind})
    endforeach()
  endforeach()
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR}/src)
  # Compiled once for both, so both are position independent; calls within the library stay within it.
  set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  if(TESSERA_SANITIZE)
    set_target_properties(${target} PROPERTIES OUTPUT_NAME ${target}_inside)  # tests look into it
  else()
    set_target_properties(${target} PROPERTIES CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  endif()
  target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-fno-semantic-interposition>)
  set_target_properties(${target}_shared PROPERTIES VERSION ${PROJECT_VERSION} SOVERSION ${arg_ABI})
  if(TESSERA_BSYMBOLIC)
    target_link_options(${target}_shared PRIVATE LINKER:-Bsymbolic-functions)
  endif()
  if(NOT TESSERA_SANITIZE AND NOT APPLE)
    target_link_options(${target}_shared PRIVATE LINKER:-z,defs)  # whatever is missing is missed here
  endif()
  # What registers itself as it is loaded would be left behind, in an archive and by linkers that record as needed only
  # what is called, as nothing asks for it by name.
  if(component MATCHES "^(io|ocio|volume)$")
    target_link_options(${target} INTERFACE LINKER:-u,tessera_component_${component})
    if(TESSERA_NO_AS_NEEDED)
      target_link_options(${target}_shared INTERFACE LINKER:--no-as-needed)
      if(TESSERA_SANITIZE)
        target_link_options(${target} INTERFACE LINKER:--no-as-needed)
      endif()
    endif()
  endif()
  if(BUILD_SHARED_LIBS)
    add_library(tessera::${component} ALIAS ${target}_shared)
  else()
    add_library(tessera::${component} ALIAS ${target})
  endif()
  # A project that has this tree as its part builds what it links.
  if(NOT PROJECT_IS_TOP_LEVEL)
    set_target_properties(${target} ${target}_shared PROPERTIES EXCLUDE_FROM_ALL ON)
  endif()
  set_property(GLOBAL APPEND PROPERTY TESSERA_COMPONENTS ${component})
endfunction()
