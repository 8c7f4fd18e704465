# Installs the build BUILD into a scratch prefix, builds the project beside this file and the examples against it, and runs
# the results.
cmake_minimum_required(VERSION 3.25)
set(work "${BUILD}/tests/install")
set(prefix "${work}/prefix")
file(REMOVE_RECURSE "${work}")
set(flags "")
if(SANITIZE)
  set(flags "-fsanitize=${SANITIZE}")
endif()

execute_process(
  COMMAND "${CMAKE_COMMAND}" --install "${BUILD}" --config "${CONFIG}" --prefix "${work}/first"
  OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY
)
# An installation can be moved.
file(RENAME "${work}/first" "${prefix}")

# The project beside this file, and the examples, as a user would build them.
foreach(project "${CMAKE_CURRENT_LIST_DIR}" "${CMAKE_CURRENT_LIST_DIR}/../../examples")
  get_filename_component(name "${project}" NAME)
  execute_process(
    COMMAND "${CMAKE_COMMAND}" -S "${project}" -B "${work}/${name}" -G "${GENERATOR}" "-DCMAKE_PREFIX_PATH=${prefix}"
            "-DCMAKE_CXX_COMPILER=${CXX}" "-DCMAKE_BUILD_TYPE=${CONFIG}" "-DCMAKE_CXX_FLAGS=${flags}"
            # They run for milliseconds however little they are optimised.
            "-DCMAKE_CXX_FLAGS_RELEASE=-O1 -DNDEBUG"
    COMMAND_ERROR_IS_FATAL ANY
  )
  execute_process(COMMAND "${CMAKE_COMMAND}" --build "${work}/${name}" --config "${CONFIG}" COMMAND_ERROR_IS_FATAL ANY)
  execute_process(
    COMMAND "${CMAKE_CTEST_COMMAND}" --test-dir "${work}/${name}" --build-config "${CONFIG}" --output-on-failure
            --no-tests=error
    COMMAND_ERROR_IS_FATAL ANY
  )
endforeach()

if(STUDIES)
  # No library with a GPL module may come in, directly or through another.
  foreach(program bin/tandem libexec/tandem-more)
    execute_process(COMMAND ldd "${prefix}/${program}" OUTPUT_VARIABLE libraries COMMAND_ERROR_IS_FATAL ANY)
    if(libraries MATCHES "lib(cholmod|spqr|umfpack|ceres)")
      message(FATAL_ERROR "${program} links ${CMAKE_MATCH_0}, which holds code under the GPL:\n${libraries}")
    endif()
  endforeach()
  execute_process(COMMAND "${prefix}/bin/tandem" estimate docking_a --max-keyframes 20 --quiet --out "${work}/out"
                  COMMAND_ERROR_IS_FATAL ANY)
  # The other program is found, and finds what it needs, in the installation.
  execute_process(COMMAND "${prefix}/bin/tandem" study list OUTPUT_VARIABLE studies COMMAND_ERROR_IS_FATAL ANY)
  if(NOT studies MATCHES "table1")
    message(FATAL_ERROR "tandem study list does not list the studies that are installed:\n${studies}")
  endif()
endif()
