# Optional libraries of tandem::recording, which reads the formats of loggers.

# tandem_find_recording_library(NAME header library package HAS): creates TandemDeps::<library> and sets HAS to TRUE. If
# the library is not installed, prints a message and sets HAS to FALSE.
function(tandem_find_recording_library name header library package has)
  find_path(TANDEM_${name}_INCLUDE_DIR ${header})
  find_library(TANDEM_${name}_LIBRARY ${library})
  mark_as_advanced(TANDEM_${name}_INCLUDE_DIR TANDEM_${name}_LIBRARY)
  if(TARGET TandemDeps::${library})
    set(${has} TRUE PARENT_SCOPE)
  elseif(TANDEM_${name}_INCLUDE_DIR AND TANDEM_${name}_LIBRARY)
    add_library(TandemDeps::${library} UNKNOWN IMPORTED GLOBAL)
    set_target_properties(
      TandemDeps::${library} PROPERTIES IMPORTED_LOCATION "${TANDEM_${name}_LIBRARY}"
                                        INTERFACE_INCLUDE_DIRECTORIES "${TANDEM_${name}_INCLUDE_DIR}"
    )
    set(${has} TRUE PARENT_SCOPE)
  else()
    set(${has} FALSE PARENT_SCOPE)
    message(STATUS "  without ${name}: tandem import reads fewer files. To change this, install ${package} and "
                   "configure again.")
  endif()
endfunction()

# tandem_recording_libraries(target): links the libraries that are found and defines TANDEM_HAS_LZ4, …
function(tandem_recording_libraries target)
  foreach(
    entry
    "LZ4;lz4frame.h;lz4;liblz4-dev"
    "ZSTD;zstd.h;zstd;libzstd-dev"
    "BZIP2;bzlib.h;bz2;libbz2-dev"
    "GEOGRAPHICLIB;GeographicLib/LocalCartesian.hpp;GeographicLib;libgeographiclib-dev"
  )
    list(POP_FRONT entry name header library package)
    tandem_find_recording_library(${name} ${header} ${library} ${package} has)
    if(has)
      target_link_libraries(${target} PRIVATE TandemDeps::${library})
      target_compile_definitions(${target} PRIVATE TANDEM_HAS_${name})
    endif()
  endforeach()
endfunction()
