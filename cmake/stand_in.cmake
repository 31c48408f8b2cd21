# What OpenImageIO needs for rare files and for none at all (OpenCV's camera brings a hundred libraries, FFmpeg another
# hundred, OpenVDB the longest relocations) takes most of a program's start, as the system loads it before the first line
# runs. The `tessera` program links libraries of the same names that are next to nothing, found beside the program;
# src/cli/start.cc loads the real ones when a line asks for them. Where the small ones are absent the system finds the
# real ones: the program starts slower and does the same.
#   tessera_stand_ins(PROGRAM USER...)   USERs: targets that call these libraries themselves
function(tessera_stand_ins program)
  find_library(TESSERA_OPENIMAGEIO_LIBRARY OpenImageIO)
  if(NOT CMAKE_SYSTEM_NAME STREQUAL "Linux" OR TESSERA_SANITIZE OR NOT TESSERA_NO_AS_NEEDED OR NOT CMAKE_READELF
      OR NOT CMAKE_NM OR NOT TESSERA_OPENIMAGEIO_LIBRARY)
    return()
  endif()
  execute_process(COMMAND ${CMAKE_READELF} -d ${TESSERA_OPENIMAGEIO_LIBRARY} OUTPUT_VARIABLE needed)
  string(REGEX MATCHALL "lib(opencv_[a-z]+|avcodec|avformat|avutil|swscale|openvdb)[.]so[.0-9]+" needed "${needed}")
  set(users ${TESSERA_OPENIMAGEIO_LIBRARY})
  foreach(user IN LISTS ARGN)
    if(TARGET ${user})
      list(APPEND users $<TARGET_FILE:${user}>)
    endif()
  endforeach()
  set(folders "")
  set(directory ${CMAKE_CURRENT_BINARY_DIR}/stand_in)
  file(MAKE_DIRECTORY ${directory})
  foreach(soname IN LISTS needed)
    find_library(TESSERA_REAL_${soname} ${soname})
    set(real ${TESSERA_REAL_${soname}})
    if(NOT real)
      continue()
    endif()
    string(REGEX REPLACE "^lib([a-z_]+).*" "\\1" name ${soname})
    set(source ${directory}/${name}.c)
    set(map ${directory}/${name}.map)
    add_custom_command(OUTPUT ${source} ${map}
      COMMAND ${PROJECT_SOURCE_DIR}/cmake/stand_in.sh ${CMAKE_NM} ${real} ${source} ${map} ${users}
      DEPENDS ${PROJECT_SOURCE_DIR}/cmake/stand_in.sh ${real} ${users} VERBATIM)
    add_library(tessera_stand_in_${name} SHARED ${source})
    set(target tessera_stand_in_${name})
    # The file bears the name itself: nobody links it but the program.
    set_target_properties(${target} PROPERTIES PREFIX "" OUTPUT_NAME ${soname} SUFFIX "" NO_SONAME ON
      LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/lib/tessera)
    target_compile_options(${target} PRIVATE -O1 -w -fno-plt)
    target_link_options(${target} PRIVATE LINKER:-soname,${soname} LINKER:--version-script=${map})
    set_property(TARGET ${target} PROPERTY LINK_DEPENDS ${map})
    target_link_libraries(${program} PRIVATE ${target})
    install(TARGETS ${target} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/tessera COMPONENT program)
    get_filename_component(folder ${real} DIRECTORY)
    list(APPEND folders ${folder})
  endforeach()
  if(folders)
    list(REMOVE_DUPLICATES folders)
    list(JOIN folders ":" folders)
    target_link_options(${program} PRIVATE LINKER:--no-as-needed)
    target_compile_definitions(${program} PRIVATE TESSERA_REAL_LIBRARIES="${folders}")
    file(RELATIVE_PATH beside ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR}/tessera)
    set_target_properties(${program} PROPERTIES INSTALL_RPATH "$ORIGIN/${beside}" BUILD_RPATH_USE_ORIGIN ON
      TESSERA_STAND_INS ON)
  endif()
endfunction()
