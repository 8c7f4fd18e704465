# What the folders' CMakeLists.txt share.

# tandem_find_optional(OPTION name RESULT): looks for an optional library as OPTION (AUTO, ON, OFF) says.
macro(tandem_find_optional option name result)
  set(${result} FALSE)
  if("${${option}}" STREQUAL "AUTO")
    cmake_language(CALL tandem_find_${name})
    set(${result} ${${name}_FOUND})
  elseif(${option})
    cmake_language(CALL tandem_find_${name} REQUIRED)
    set(${result} TRUE)
  endif()
endmacro()

# tandem_library(name [NO_INSTALL] [SOURCES ...] [PUBLIC libs ...] [PRIVATE libs ...]): the target tandem::<name>.
# Without sources it is an interface library. Headers are found by their path in the tree, <tandem/problem/problem.hpp>,
# and need not be listed; they are installed by tandem_install_headers().
function(tandem_library name)
  cmake_parse_arguments(ARG "NO_INSTALL" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  set(target tandem_${name})
  if(ARG_SOURCES)
    add_library(${target} STATIC ${ARG_SOURCES})
    set(scope PUBLIC)
    target_link_libraries(${target} PRIVATE ${ARG_PRIVATE})
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  else()
    add_library(${target} INTERFACE)
    set(scope INTERFACE)
  endif()
  add_library(tandem::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  target_compile_features(${target} ${scope} cxx_std_20)
  target_link_libraries(${target} ${scope} ${ARG_PUBLIC})
  target_include_directories(
    ${target} ${scope} "$<BUILD_INTERFACE:${TANDEM_BUILD_INCLUDE_DIR}>" "$<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>"
  )
  if(NOT ARG_NO_INSTALL)
    install(TARGETS ${target} EXPORT tandem-targets ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}")
  endif()
endfunction()

# What most sources read.
set(TANDEM_COMMON_HEADERS
    <algorithm> <array> <cmath> <deque> <filesystem> <fstream> <functional> <map> <memory> <numbers> <optional> <span>
    <string> <string_view> <tuple> <typeindex> <utility> <variant> <vector>
    <Eigen/Core> <Eigen/Cholesky> <Eigen/Geometry>
)

# tandem_precompile(name header ...): headers that most of its sources read, parsed once; Tandem's own only where nearly all
# read them, so that what a change reaches is what includes it.  tandem_precompile(name REUSE other): those of another
# library.
function(tandem_precompile name)
  if(NOT TANDEM_PRECOMPILE)
    return()
  endif()
  if(ARGV1 STREQUAL "REUSE")
    target_precompile_headers(tandem_${name} REUSE_FROM tandem_${ARGV2})
  else()
    target_precompile_headers(tandem_${name} PRIVATE ${ARGN})
  endif()
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(tandem_${name} PRIVATE -fpch-preprocess) # for ccache
  elseif(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
    target_compile_options(tandem_${name} PRIVATE "SHELL:-Xclang -fno-pch-timestamp") # for ccache
  endif()
endfunction()

# tandem_unite(target [BATCH n] [APART file ...]): the target's sources in one folder are one unit of compilation, or one for
# every n of them, since what small sources spend their time on, headers and what they instantiate, is the same in all of
# them; those that take long by themselves stay apart. Names in a folder's unnamed namespaces have to differ. Without
# TANDEM_UNITY each source is a unit.
function(tandem_unite target)
  if(NOT TANDEM_UNITY)
    return()
  endif()
  cmake_parse_arguments(ARG "" "BATCH" "APART" ${ARGN})
  get_target_property(sources ${target} SOURCES)
  list(REMOVE_ITEM sources ${ARG_APART})
  foreach(source ${sources})
    cmake_path(GET source PARENT_PATH folder)
    string(MAKE_C_IDENTIFIER "all_${folder}" group)
    math(EXPR count_${group} "0${count_${group}} + 1")
    if(ARG_BATCH)
      math(EXPR batch "(${count_${group}} - 1) / ${ARG_BATCH}")
      string(APPEND group "_${batch}")
    endif()
    set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${group})
  endforeach()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(${target} PRIVATE -Wno-subobject-linkage) # takes what is included here for a header
  endif()
endfunction()

# tandem_libraries_of(RESULT target ...): the tandem:: libraries among these, and all that they link, each once.
function(tandem_libraries_of result)
  set(found "")
  set(open ${ARGN})
  while(open)
    list(POP_FRONT open target)
    string(REGEX REPLACE "^tandem::" "tandem_" target "${target}")
    if(NOT target MATCHES "^tandem_" OR target IN_LIST found)
      continue()
    endif()
    list(APPEND found ${target})
    get_target_property(linked ${target} LINK_LIBRARIES)
    list(APPEND open ${linked})
  endwhile()
  set(${result} ${found} PARENT_SCOPE)
endfunction()

# tandem_install_headers(folder): of this folder and those below it.
function(tandem_install_headers folder)
  install(
    DIRECTORY "${PROJECT_SOURCE_DIR}/${folder}/" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/tandem/${folder}"
    FILES_MATCHING PATTERN "*.hpp"
  )
endfunction()

# tandem_sources(RESULT folder ...): the sources right in these folders, so that a new one is built as soon as it is there.
function(tandem_sources result)
  list(TRANSFORM ARGN APPEND "/*.cpp" OUTPUT_VARIABLE patterns)
  file(GLOB found CONFIGURE_DEPENDS RELATIVE "${CMAKE_CURRENT_SOURCE_DIR}" ${patterns})
  set(${result} ${found} PARENT_SCOPE)
endfunction()

# Compile through ccache when it is installed.
macro(tandem_use_ccache)
  find_program(TANDEM_CCACHE ccache)
  mark_as_advanced(TANDEM_CCACHE)
  if(TANDEM_CCACHE AND PROJECT_IS_TOP_LEVEL AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
    # Where ccache has no folder it can write to, every compilation through it would fail.
    file(WRITE "${PROJECT_BINARY_DIR}/ccache_probe.cpp" "int probe;\n")
    execute_process(
      COMMAND "${TANDEM_CCACHE}" "${CMAKE_CXX_COMPILER}" -c ccache_probe.cpp -o ccache_probe.o
      WORKING_DIRECTORY "${PROJECT_BINARY_DIR}" RESULT_VARIABLE ccache_result OUTPUT_QUIET ERROR_QUIET
    )
    if(ccache_result EQUAL 0)
      # What these ignore is what it takes to keep a compilation that reads precompiled headers.
      set(CMAKE_CXX_COMPILER_LAUNCHER
          "${CMAKE_COMMAND}" -E env CCACHE_SLOPPINESS=pch_defines,time_macros "${TANDEM_CCACHE}"
      )
    endif()
  endif()
endmacro()
