# Installs the build BUILD into a temporary prefix, builds the external project in this folder and the examples against
# it, and runs them.
cmake_minimum_required(VERSION 3.22)
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
# Moves the installation, which must keep working.
file(RENAME "${work}/first" "${prefix}")

# Builds the external project and the examples as a user would.
foreach(project "${CMAKE_CURRENT_LIST_DIR}" "${CMAKE_CURRENT_LIST_DIR}/../../examples")
  get_filename_component(name "${project}" NAME)
  execute_process(
    COMMAND "${CMAKE_COMMAND}" -S "${project}" -B "${work}/${name}" -G "${GENERATOR}" "-DCMAKE_PREFIX_PATH=${prefix}"
            "-DCMAKE_CXX_COMPILER=${CXX}" "-DCMAKE_BUILD_TYPE=${CONFIG}" "-DCMAKE_CXX_FLAGS=${flags}"
            # Optimisation does not matter: they run for milliseconds.
            "-DCMAKE_CXX_FLAGS_RELEASE=-O0 -DNDEBUG"
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
  # No library with a GPL module may be linked, directly or indirectly.
  foreach(program libexec/tandem/tandem-estimate libexec/tandem/tandem-study)
    execute_process(COMMAND ldd "${prefix}/${program}" OUTPUT_VARIABLE libraries COMMAND_ERROR_IS_FATAL ANY)
    if(libraries MATCHES "lib(cholmod|spqr|umfpack|ceres)")
      message(FATAL_ERROR "${program} links ${CMAKE_MATCH_0}, which holds code under the GPL:\n${libraries}")
    endif()
  endforeach()
  execute_process(COMMAND "${prefix}/bin/tandem" estimate docking_a --max-keyframes 20 --quiet --out "${work}/out"
                  COMMAND_ERROR_IS_FATAL ANY)
  # The installed command must be found and must find its data.
  execute_process(COMMAND "${prefix}/bin/tandem" study list OUTPUT_VARIABLE studies COMMAND_ERROR_IS_FATAL ANY)
  if(NOT studies MATCHES "table1")
    message(FATAL_ERROR "tandem study list does not list the studies that are installed:\n${studies}")
  endif()
endif()
