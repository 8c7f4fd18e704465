# Builds Debian packages with CPack (scripts/package): tandem (the program with its data, man pages and shell
# completion), libtandem-dev (libraries, headers and CMake package) and, if it is built, python3-tandem.
if(NOT EXISTS "/etc/debian_version" OR NOT TANDEM_STUDIES)
  return()
endif()
if(BUILD_SHARED_LIBS)
  message(STATUS "Debian packages: OFF (their programs contain the libraries; configure with BUILD_SHARED_LIBS=OFF)")
  return()
endif()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME tandem)
set(CPACK_PACKAGE_VENDOR "Tandem")
set(CPACK_PACKAGE_CONTACT "Tandem developers <tandem@example.org>")
set(CPACK_PACKAGE_VERSION "${PROJECT_VERSION}")
set(CPACK_PACKAGING_INSTALL_PREFIX "/usr")
set(CPACK_PACKAGE_DIRECTORY "${PROJECT_BINARY_DIR}/packages")
set(CPACK_STRIP_FILES TRUE)
set(CPACK_COMPONENTS_ALL program library)
set(packages "program=tandem" "library=libtandem-dev")
if(TANDEM_HAS_PYTHON)
  list(APPEND CPACK_COMPONENTS_ALL python)
  list(APPEND packages "python=python3-tandem")
endif()
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION TRUE)

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME tandem)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS "gnuplot-nox | gnuplot")
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION
    "estimates the trajectories of a vehicle and a moving target
 Tandem estimates the trajectory of a vehicle and of a moving target that it
 observes sparsely, and plans the vehicle's motion relative to the predicted
 target. This package contains the command line."
)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME libtandem-dev)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libdevel)
set(depends "libeigen3-dev, libsuitesparse-dev, libfmt-dev, libyaml-cpp-dev")
foreach(optional "TBB;libtbb-dev" "IPOPT;coinor-libipopt-dev" "NLOPT;libnlopt-dev, libnlopt-cxx-dev")
  list(POP_FRONT optional name)
  if(TANDEM_HAS_${name})
    string(APPEND depends ", ${optional}")
  endif()
endforeach()
set(CPACK_DEBIAN_LIBRARY_PACKAGE_DEPENDS "${depends}")
set(CPACK_COMPONENT_LIBRARY_DESCRIPTION
    "C++ library of Tandem: estimation on Lie groups with hard constraints
 Lie groups, residuals, nonlinear programs, solvers, fixed-lag smoothing and
 planning, with headers and a CMake package."
)

set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-tandem)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
# The compiled module works with one minor version of Python only.
set(from "${Python_VERSION_MAJOR}.${Python_VERSION_MINOR}")
math(EXPR next_minor "0${Python_VERSION_MINOR} + 1")
set(below "${Python_VERSION_MAJOR}.${next_minor}")
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
    "tandem (= ${PROJECT_VERSION}), python3 (>= ${from}), python3 (<< ${below}), python3-numpy"
)
set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS "python3-matplotlib, python3-pandas, python3-tqdm")
set(CPACK_COMPONENT_PYTHON_DESCRIPTION
    "Python package of Tandem: estimation with hard constraints on Lie groups
 Whole runs of the command line, Lie groups, nonlinear programs with residuals
 in Python, covariances and fixed-lag smoothing."
)

# Debian policy requires a licence and a changelog in every package.
string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)
file(WRITE "${PROJECT_BINARY_DIR}/debian/changelog"
     "tandem (${PROJECT_VERSION}) unstable; urgency=low\n\n  * See CHANGELOG.md in the source.\n\n"
     " -- ${CPACK_PACKAGE_CONTACT}  ${date}\n"
)
find_program(TANDEM_GZIP gzip REQUIRED)
mark_as_advanced(TANDEM_GZIP)
execute_process(COMMAND "${TANDEM_GZIP}" -9nf "${PROJECT_BINARY_DIR}/debian/changelog" COMMAND_ERROR_IS_FATAL ANY)
foreach(pair ${packages})
  string(REPLACE "=" ";" pair "${pair}")
  list(GET pair 0 component)
  list(GET pair 1 package)
  set(doc "${CMAKE_INSTALL_DATAROOTDIR}/doc/${package}")
  install(FILES LICENSE DESTINATION "${doc}" RENAME copyright COMPONENT ${component} EXCLUDE_FROM_ALL)
  install(FILES "${PROJECT_BINARY_DIR}/debian/changelog.gz" DESTINATION "${doc}" COMPONENT ${component} EXCLUDE_FROM_ALL)
endforeach()
include(CPack)
