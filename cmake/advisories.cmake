# Versions of the libraries that read files, below which advisories are known: a warning names them as the build is
# configured. Distributions mend old versions, so where Debian's package is installed its own version counts. SECURITY.md
# lists the same (tests/house/advisories.cmake holds that), with where they are from.
#   name | Debian's package | its version that mends them, or - | version of the library that does | advisories
set(TESSERA_ADVISORIES
  "OpenImageIO|libopenimageio2*|-|2.5.13.1|CVE-2023-22845 CVE-2023-24472 CVE-2023-24473 CVE-2023-36183 CVE-2023-42295 CVE-2024-40630"
  "OpenEXR|libopenexr-3-*|-|3.1.12|CVE-2023-5841"
  "libtiff-4|libtiff6|4.5.0-6+deb12u4|4.7.1|CVE-2024-7006 CVE-2025-9900"
  "libpng16|libpng16-16*|1.6.39-2+deb12u2|1.6.54|CVE-2025-64720 CVE-2025-65018 CVE-2025-66293 CVE-2026-22801"
  "libwebp|libwebp7|1.2.4-0.2+deb12u1|1.3.2|CVE-2023-4863"
  "libheif|libheif1|1.15.1-1+deb12u1|1.18.0|CVE-2023-29659 CVE-2023-49462 CVE-2024-41311"
  "libde265|libde265-0|1.0.11-1+deb12u2|1.0.15|CVE-2023-49465 CVE-2023-49467 CVE-2023-49468"
  "libopenjp2|libopenjp2-7|2.5.0-2+deb12u1|2.5.3|CVE-2024-56826 CVE-2024-56827")

# The row's library as it was found: version, and package where that is Debian's. Empty where it was not.
#   OpenImageIO_VERSION and the like, where find_package set them; else Debian's package; else pkg-config.
function(tessera_found_version name package version_out debian_out)
  set(version "${${name}_VERSION}")
  set(debian "")
  find_program(DPKG_QUERY dpkg-query)
  if(DPKG_QUERY)
    execute_process(COMMAND ${DPKG_QUERY} -W -f "\${db:Status-Status} \${Version}\n" ${package}
      OUTPUT_VARIABLE packages ERROR_QUIET)
    if(packages MATCHES "(^|\n)installed ([^\n]+)")
      set(debian ${CMAKE_MATCH_2})
      if(NOT version)
        string(REGEX REPLACE "^[0-9]+:" "" version "${debian}")
        string(REGEX REPLACE "[^0-9.].*$" "" version "${version}")
      endif()
    endif()
  endif()
  find_program(PKG_CONFIG_PROGRAM pkg-config)
  if(NOT version AND PKG_CONFIG_PROGRAM)
    execute_process(COMMAND ${PKG_CONFIG_PROGRAM} --modversion ${name} OUTPUT_VARIABLE version ERROR_QUIET
      OUTPUT_STRIP_TRAILING_WHITESPACE)
  endif()
  set(${version_out} "${version}" PARENT_SCOPE)
  set(${debian_out} "${debian}" PARENT_SCOPE)
endfunction()

# Whether a version has what the row's advisories tell of.
function(tessera_is_affected version debian mended_debian mended out)
  set(${out} FALSE PARENT_SCOPE)
  if(NOT version OR NOT version VERSION_LESS mended)
    return()
  endif()
  find_program(DPKG dpkg)
  if(debian AND DPKG AND NOT mended_debian STREQUAL "-")
    execute_process(COMMAND ${DPKG} --compare-versions ${debian} ge ${mended_debian} RESULT_VARIABLE older)
    if(older EQUAL 0)
      return()
    endif()
  endif()
  set(${out} TRUE PARENT_SCOPE)
endfunction()

# One warning for all.
function(tessera_warn_of_advisories)
  set(lines "")
  foreach(row IN LISTS TESSERA_ADVISORIES)
    string(REPLACE "|" ";" row "${row}")
    list(GET row 0 name)
    list(GET row 1 package)
    list(GET row 2 mended_debian)
    list(GET row 3 mended)
    list(GET row 4 advisories)
    tessera_found_version(${name} ${package} version debian)
    tessera_is_affected("${version}" "${debian}" ${mended_debian} ${mended} affected)
    if(affected)
      string(APPEND lines "\n  ${name} ${version}: ${advisories}; ${mended} has them mended")
    endif()
  endforeach()
  if(lines)
    message(WARNING "Libraries with known advisories will read files:${lines}\nSee SECURITY.md.")
  endif()
endfunction()
