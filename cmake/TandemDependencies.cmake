# Finds the solver libraries that have no reliable CMake package. The build and the installed package include this file,
# because users of a static library also link its private dependencies.
#
# Each function creates imported targets, whose headers are system headers, and sets <NAME>_FOUND in its caller.

# tandem_find_suitesparse([REQUIRED]): TandemDeps::amd, the ordering of SuiteSparse (BSD-3-Clause).
#
# CHOLMOD is not used: cholmod_factorize and cholmod_solve call the Supernodal module, which is under the GPL-2+ in
# Debian's libcholmod.
function(tandem_find_suitesparse)
  cmake_parse_arguments(ARG "REQUIRED" "" "" ${ARGN})
  find_path(TANDEM_AMD_INCLUDE_DIR amd.h PATH_SUFFIXES suitesparse)
  find_library(TANDEM_AMD_LIBRARY amd)
  mark_as_advanced(TANDEM_AMD_INCLUDE_DIR TANDEM_AMD_LIBRARY)
  if(TANDEM_AMD_INCLUDE_DIR AND TANDEM_AMD_LIBRARY)
    _tandem_imported(amd "${TANDEM_AMD_LIBRARY}" "${TANDEM_AMD_INCLUDE_DIR}" "")
    set(suitesparse_FOUND TRUE PARENT_SCOPE)
  elseif(ARG_REQUIRED)
    message(FATAL_ERROR "SuiteSparse's AMD was not found: install libsuitesparse-dev.")
  else()
    set(suitesparse_FOUND FALSE PARENT_SCOPE)
  endif()
endfunction()

# tandem_find_ipopt([REQUIRED]): TandemDeps::ipopt, with headers in coin/ (3.11 in Debian 12) or coin-or/ (since 3.13).
function(tandem_find_ipopt)
  cmake_parse_arguments(ARG "REQUIRED" "" "" ${ARGN})
  find_package(PkgConfig QUIET)
  if(PkgConfig_FOUND)
    pkg_check_modules(TANDEM_PC_IPOPT QUIET ipopt)
  endif()
  find_path(
    TANDEM_IPOPT_INCLUDE_DIR IpIpoptApplication.hpp HINTS ${TANDEM_PC_IPOPT_INCLUDE_DIRS} PATH_SUFFIXES coin-or coin
  )
  find_library(TANDEM_IPOPT_LIBRARY ipopt HINTS ${TANDEM_PC_IPOPT_LIBRARY_DIRS})
  mark_as_advanced(TANDEM_IPOPT_INCLUDE_DIR TANDEM_IPOPT_LIBRARY)
  if(TANDEM_IPOPT_INCLUDE_DIR AND TANDEM_IPOPT_LIBRARY)
    # Ipopt's headers need HAVE_CSTDDEF, which pkg-config may not provide.
    set(options ${TANDEM_PC_IPOPT_CFLAGS_OTHER} -DHAVE_CSTDDEF)
    list(REMOVE_DUPLICATES options)
    _tandem_imported(ipopt "${TANDEM_IPOPT_LIBRARY}" "${TANDEM_IPOPT_INCLUDE_DIR}" "${options}")
    set(ipopt_FOUND TRUE PARENT_SCOPE)
  elseif(ARG_REQUIRED)
    message(FATAL_ERROR "Ipopt was not found: install coinor-libipopt-dev, or configure with -DTANDEM_WITH_IPOPT=OFF.")
  else()
    set(ipopt_FOUND FALSE PARENT_SCOPE)
  endif()
endfunction()

# tandem_find_nlopt([REQUIRED]): TandemDeps::nlopt, with the C++ header nlopt.hpp (libnlopt-cxx-dev in Debian).
function(tandem_find_nlopt)
  cmake_parse_arguments(ARG "REQUIRED" "" "" ${ARGN})
  find_package(PkgConfig QUIET)
  if(PkgConfig_FOUND)
    pkg_check_modules(TANDEM_PC_NLOPT QUIET nlopt)
  endif()
  find_path(TANDEM_NLOPT_INCLUDE_DIR nlopt.hpp HINTS ${TANDEM_PC_NLOPT_INCLUDE_DIRS})
  # The header consists of inline wrappers of the C functions, which both Debian libraries contain.
  find_library(TANDEM_NLOPT_LIBRARY NAMES nlopt nlopt_cxx HINTS ${TANDEM_PC_NLOPT_LIBRARY_DIRS})
  mark_as_advanced(TANDEM_NLOPT_INCLUDE_DIR TANDEM_NLOPT_LIBRARY)
  if(TANDEM_NLOPT_INCLUDE_DIR AND TANDEM_NLOPT_LIBRARY)
    _tandem_imported(nlopt "${TANDEM_NLOPT_LIBRARY}" "${TANDEM_NLOPT_INCLUDE_DIR}" "")
    set(nlopt_FOUND TRUE PARENT_SCOPE)
  elseif(ARG_REQUIRED)
    message(FATAL_ERROR "NLopt with its C++ header was not found: install libnlopt-dev and libnlopt-cxx-dev, "
                        "or configure with -DTANDEM_WITH_NLOPT=OFF.")
  else()
    set(nlopt_FOUND FALSE PARENT_SCOPE)
  endif()
endfunction()

function(_tandem_imported name library include_dir options)
  if(TARGET TandemDeps::${name})
    return()
  endif()
  add_library(TandemDeps::${name} UNKNOWN IMPORTED GLOBAL)
  set_target_properties(
    TandemDeps::${name}
    PROPERTIES IMPORTED_LOCATION "${library}" INTERFACE_INCLUDE_DIRECTORIES "${include_dir}"
               INTERFACE_COMPILE_OPTIONS "${options}"
  )
endfunction()
