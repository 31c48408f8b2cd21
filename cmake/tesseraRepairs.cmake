# Mends imported packages; read by the build itself and by the installed package, after the dependencies were found.

# Debian's OpenImageIO names OpenCV's headers among its include directories. It does not need them, and CMake
# refuses a target whose include directory is absent.
foreach(tessera_property INTERFACE_INCLUDE_DIRECTORIES INTERFACE_SYSTEM_INCLUDE_DIRECTORIES)
  get_target_property(tessera_present OpenImageIO::OpenImageIO ${tessera_property})
  if(tessera_present)
    set(tessera_kept "")
    foreach(tessera_directory IN LISTS tessera_present)
      if(tessera_directory MATCHES "[$]<" OR EXISTS "${tessera_directory}")
        list(APPEND tessera_kept "${tessera_directory}")
      endif()
    endforeach()
    set_target_properties(OpenImageIO::OpenImageIO PROPERTIES ${tessera_property} "${tessera_kept}")
  endif()
endforeach()
unset(tessera_kept)
unset(tessera_present)
