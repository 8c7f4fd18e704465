# Functions shared by the CMakeLists.txt of the folders.

# tandem_find_optional(OPTION name RESULT): finds an optional library according to OPTION (AUTO, ON, OFF).
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

# tandem_find_test_libraries([REQUIRED]): GoogleTest, nlohmann-json and Ceres's jet.h, whose dual numbers check Jacobians.
# Nothing of Ceres is linked.
macro(tandem_find_test_libraries)
  find_package(GTest QUIET ${ARGN})
  find_package(nlohmann_json QUIET ${ARGN})
  find_path(TANDEM_CERES_INCLUDE_DIR ceres/jet.h ${ARGN})
  mark_as_advanced(TANDEM_CERES_INCLUDE_DIR)
  set(test_libraries_FOUND FALSE)
  if(GTest_FOUND AND nlohmann_json_FOUND AND TANDEM_CERES_INCLUDE_DIR)
    set(test_libraries_FOUND TRUE)
  endif()
endmacro()

# tandem_find_python([REQUIRED]): the Python interpreter with its headers, NumPy and pybind11.
macro(tandem_find_python)
  find_package(Python 3.9 QUIET ${ARGN} COMPONENTS Interpreter Development.Module)
  if(Python_FOUND)
    find_package(pybind11 2.10 QUIET CONFIG ${ARGN})
  endif()
  set(python_FOUND FALSE)
  if(Python_FOUND AND pybind11_FOUND)
    set(python_FOUND TRUE)
  endif()
endmacro()

# tandem_library(name [NO_INSTALL] [COLD] [SOURCES ...] [PUBLIC libs ...] [PRIVATE libs ...]): adds the target
# tandem::<name>, an interface library if it has no sources. Headers are included by their path in the tree,
# <tandem/problem/problem.hpp>, and need not be listed; tandem_install_headers() installs them. COLD: see tandem_cold.
function(tandem_library name)
  cmake_parse_arguments(ARG "NO_INSTALL;COLD" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  set(target tandem_${name})
  if(ARG_SOURCES)
    add_library(${target} ${ARG_SOURCES})
    set(scope PUBLIC)
    target_link_libraries(${target} PRIVATE ${ARG_PRIVATE})
    set_target_properties(
      ${target} PROPERTIES POSITION_INDEPENDENT_CODE ON VERSION "${PROJECT_VERSION}"
                           SOVERSION "${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}" INSTALL_RPATH "$ORIGIN"
                           DEFINE_SYMBOL "" # shared and static libraries have the same objects in ccache
    )
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
  if(ARG_COLD)
    tandem_cold(${target})
  endif()
  if(NOT ARG_NO_INSTALL)
    install(
      TARGETS ${target} EXPORT tandem-targets
      ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT library
      LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT library
    )
    set_property(GLOBAL APPEND PROPERTY TANDEM_INSTALLED_LIBRARIES ${target})
  elseif(BUILD_SHARED_LIBS)
    install(TARGETS ${target} LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT program)
  endif()
endfunction()

# tandem_relocatable(folder targets ...): lets targets that are installed in the folder find Tandem's shared libraries by
# a relative path.
function(tandem_relocatable folder)
  if(BUILD_SHARED_LIBS)
    file(RELATIVE_PATH to_libraries "/${folder}" "/${CMAKE_INSTALL_LIBDIR}")
    set_target_properties(${ARGN} PROPERTIES INSTALL_RPATH "$ORIGIN/${to_libraries}")
  endif()
endfunction()

# tandem_cold(targets ...): optimises less, because the targets take no part in the loops of solvers. This saves a sixth
# (clang) to a third (GCC) of their compile time, and half of it with sanitizers.
function(tandem_cold)
  foreach(target ${ARGN})
    if(TANDEM_SANITIZE)
      target_compile_options(${target} PRIVATE -O0)
      set_target_properties(${target} PROPERTIES TANDEM_UNOPTIMISED ON)
    else()
      target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
    endif()
  endforeach()
endfunction()

# tandem_hot(source ...): optimises these sources also with sanitizers, whose tests would else spend half of their time there.
function(tandem_hot)
  if(TANDEM_SANITIZE)
    set_source_files_properties(${ARGN} PROPERTIES COMPILE_OPTIONS -O2)
  endif()
endfunction()

# tandem_install_pkgconfig(): installs tandem.pc, which links all installed libraries.
function(tandem_install_pkgconfig)
  get_property(libraries GLOBAL PROPERTY TANDEM_INSTALLED_LIBRARIES)
  list(REVERSE libraries) # users before what they use
  set(TANDEM_PC_LIBS "")
  foreach(library ${libraries})
    get_target_property(type ${library} TYPE)
    if(NOT type STREQUAL "INTERFACE_LIBRARY")
      string(APPEND TANDEM_PC_LIBS " -l${library}")
    endif()
  endforeach()
  set(TANDEM_PC_REQUIRES "eigen3")
  set(TANDEM_PC_PRIVATE "-lamd")
  foreach(optional "TBB;-ltbb" "IPOPT;-lipopt" "NLOPT;-lnlopt")
    list(POP_FRONT optional name)
    if(TANDEM_HAS_${name})
      string(APPEND TANDEM_PC_PRIVATE " ${optional}")
    endif()
  endforeach()
  if(TANDEM_STUDIES)
    string(APPEND TANDEM_PC_PRIVATE " -lyaml-cpp -lfmt")
  endif()
  # A program that links static libraries must also name the libraries that these use.
  if(NOT BUILD_SHARED_LIBS)
    string(APPEND TANDEM_PC_LIBS " ${TANDEM_PC_PRIVATE}")
  endif()
  configure_file("${PROJECT_SOURCE_DIR}/cmake/tandem.pc.in" "${PROJECT_BINARY_DIR}/cmake/tandem.pc" @ONLY)
  install(FILES "${PROJECT_BINARY_DIR}/cmake/tandem.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig" COMPONENT library)
endfunction()

# tandem_print_summary(): prints one line about the build and one line for each optional dependency that is missing.
function(tandem_print_summary)
  message(STATUS "Tandem ${TANDEM_VERSION_TEXT}: command line ${TANDEM_STUDIES}")
  foreach(
    entry
    "TANDEM_HAS_TBB;oneTBB;evaluation uses one thread;libtbb-dev"
    "TANDEM_HAS_IPOPT;Ipopt;no solver ipopt;coinor-libipopt-dev"
    "TANDEM_HAS_NLOPT;NLopt;no solver nlopt;libnlopt-dev libnlopt-cxx-dev"
    "TANDEM_HAS_MPI;MPI;studies run on one computer only;libopenmpi-dev"
    "TANDEM_HAS_PYTHON;pybind11 and Python's headers;no Python package;pybind11-dev python3-dev python3-numpy"
    "TANDEM_HAS_TESTS;GoogleTest and Ceres;no tests;libgtest-dev libgmock-dev libceres-dev"
    "TANDEM_HAS_BENCHMARKS;Ceres and Google Benchmark;no target benchmarks;libceres-dev libbenchmark-dev"
  )
    list(POP_FRONT entry found name consequence packages)
    if(NOT ${found})
      message(STATUS "  without ${name}: ${consequence}. To change this, install ${packages} and configure again.")
    endif()
  endforeach()
endfunction()

# Headers that most sources include.
set(TANDEM_COMMON_HEADERS
    <algorithm> <array> <cmath> <deque> <filesystem> <fstream> <functional> <map> <memory> <numbers> <optional> <span>
    <string> <string_view> <tuple> <typeindex> <utility> <variant> <vector>
    <Eigen/Core> <Eigen/Cholesky> <Eigen/Geometry>
)
# For libraries above residuals: these headers also instantiate the operations of the groups.
set(TANDEM_PROBLEM_HEADERS
    ${TANDEM_COMMON_HEADERS} "${CMAKE_CURRENT_LIST_DIR}/instantiations.hpp" <tandem/problem/problem.hpp>
)

# tandem_precompile(name header ...): precompiles headers that most sources of the library include. List Tandem's own
# headers only if nearly all sources include them; otherwise a change would recompile sources that do not use them.
# tandem_precompile(name REUSE other): reuses the precompiled headers of another library, unless only one of the two is
# compiled without optimisation.
function(tandem_precompile name)
  if(NOT TANDEM_PRECOMPILE)
    return()
  endif()
  if(ARGV1 STREQUAL "REUSE")
    get_property(unoptimised TARGET tandem_${name} PROPERTY TANDEM_UNOPTIMISED SET)
    get_property(other_unoptimised TARGET tandem_${ARGV2} PROPERTY TANDEM_UNOPTIMISED SET)
    if(NOT unoptimised EQUAL other_unoptimised)
      return()
    endif()
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

# tandem_unite(target [BATCH n] [APART file ...]): compiles the target's sources of each folder as one unit, or as one
# unit for every n sources. Small sources spend most of their compile time on the same headers and instantiations. Keep
# sources that take long APART. Names in the unnamed namespaces of a folder must differ. Without TANDEM_UNITY each
# source is a unit.
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
    target_compile_options(${target} PRIVATE -Wno-subobject-linkage) # warns as if the sources were headers
  endif()
endfunction()

# tandem_libraries_of(RESULT target ...): lists the tandem:: libraries among the targets and in their link dependencies,
# each once.
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

# tandem_install_headers(folder): installs the headers of the folder and its subfolders.
function(tandem_install_headers folder)
  install(
    DIRECTORY "${PROJECT_SOURCE_DIR}/${folder}/" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/tandem/${folder}"
    COMPONENT library
    FILES_MATCHING PATTERN "*.hpp"
  )
endfunction()

# tandem_sources(RESULT folder ...): lists the sources directly in these folders. CMake detects new files automatically.
function(tandem_sources result)
  list(TRANSFORM ARGN APPEND "/*.cpp" OUTPUT_VARIABLE patterns)
  file(GLOB found CONFIGURE_DEPENDS RELATIVE "${CMAKE_CURRENT_SOURCE_DIR}" ${patterns})
  set(${result} ${found} PARENT_SCOPE)
endfunction()

# Links with LLD if it is installed, which takes a fifth of the time of GNU ld. A linker that the user selects has priority.
macro(tandem_use_lld)
  if(PROJECT_IS_TOP_LEVEL AND NOT CMAKE_LINKER_TYPE AND NOT CMAKE_EXE_LINKER_FLAGS MATCHES "-fuse-ld")
    include(CheckLinkerFlag)
    check_linker_flag(CXX -fuse-ld=lld TANDEM_HAS_LLD)
    if(TANDEM_HAS_LLD)
      add_link_options(-fuse-ld=lld)
    endif()
  endif()
endmacro()

# Uses ccache if it is installed.
macro(tandem_use_ccache)
  find_program(TANDEM_CCACHE ccache)
  mark_as_advanced(TANDEM_CCACHE)
  if(TANDEM_CCACHE AND PROJECT_IS_TOP_LEVEL AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
    # If ccache cannot write its folder, every compilation fails. One compilation is therefore tried first.
    file(WRITE "${PROJECT_BINARY_DIR}/ccache_probe.cpp" "int probe;\n")
    execute_process(
      COMMAND "${TANDEM_CCACHE}" "${CMAKE_CXX_COMPILER}" -c ccache_probe.cpp -o ccache_probe.o
      WORKING_DIRECTORY "${PROJECT_BINARY_DIR}" RESULT_VARIABLE ccache_result OUTPUT_QUIET ERROR_QUIET
    )
    if(ccache_result EQUAL 0)
      # ccache needs these settings to cache compilations with precompiled headers.
      set(CMAKE_CXX_COMPILER_LAUNCHER
          "${CMAKE_COMMAND}" -E env CCACHE_SLOPPINESS=pch_defines,time_macros "${TANDEM_CCACHE}"
      )
    endif()
  endif()
endmacro()
