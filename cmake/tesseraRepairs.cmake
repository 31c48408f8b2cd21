# Mends imported packages; read by the build itself and by the installed package, after the dependencies were found.

# CMake refuses a target whose include directory is absent. Debian's OpenColorIO, whose package file sits one folder too
# high, names /include (its headers are in /usr/include, where the compiler looks anyway). Debian's OpenImageIO names
# OpenCV's headers, which it does not need: never kept, or installing OpenCV would change every command that compiles.
foreach(tessera_target OpenImageIO::OpenImageIO OpenColorIO::OpenColorIO)
  if(TARGET ${tessera_target})
    foreach(tessera_property INTERFACE_INCLUDE_DIRECTORIES INTERFACE_SYSTEM_INCLUDE_DIRECTORIES)
      get_target_property(tessera_present ${tessera_target} ${tessera_property})
      if(tessera_present)
        set(tessera_kept "")
        foreach(tessera_directory IN LISTS tessera_present)
          if(tessera_directory MATCHES "[$]<" OR (EXISTS "${tessera_directory}" AND NOT tessera_directory MATCHES "opencv"))
            list(APPEND tessera_kept "${tessera_directory}")
          endif()
        endforeach()
        set_target_properties(${tessera_target} PROPERTIES ${tessera_property} "${tessera_kept}")
      endif()
    endforeach()
  endif()
endforeach()
unset(tessera_kept)
unset(tessera_present)
