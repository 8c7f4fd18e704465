# Installs the build BUILD into a scratch prefix, builds the project beside this file against it, and runs the result.
cmake_minimum_required(VERSION 3.25)
set(work "${BUILD}/tests/install")
set(prefix "${work}/prefix")
set(consumer "${work}/consumer")
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

execute_process(
  COMMAND "${CMAKE_COMMAND}" -S "${CMAKE_CURRENT_LIST_DIR}" -B "${consumer}" -G "${GENERATOR}"
          "-DCMAKE_PREFIX_PATH=${prefix}" "-DCMAKE_CXX_COMPILER=${CXX}" "-DCMAKE_BUILD_TYPE=${CONFIG}"
          "-DCMAKE_CXX_FLAGS=${flags}"
  COMMAND_ERROR_IS_FATAL ANY
)
execute_process(COMMAND "${CMAKE_COMMAND}" --build "${consumer}" --config "${CONFIG}" COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND "${consumer}/consumer" COMMAND_ERROR_IS_FATAL ANY)

if(STUDIES)
  # No library with a GPL module may come in, directly or through another.
  execute_process(COMMAND ldd "${prefix}/bin/tandem" OUTPUT_VARIABLE libraries COMMAND_ERROR_IS_FATAL ANY)
  if(libraries MATCHES "lib(cholmod|spqr|umfpack|ceres)")
    message(FATAL_ERROR "tandem links ${CMAKE_MATCH_0}, which holds code under the GPL:\n${libraries}")
  endif()
  execute_process(COMMAND "${prefix}/bin/tandem" estimate docking_a --max-keyframes 20 --quiet --out "${work}/out"
                  COMMAND_ERROR_IS_FATAL ANY)
endif()
