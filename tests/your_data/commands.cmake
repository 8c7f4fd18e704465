# Checks the options of all commands that the pages of SOURCE show: runs each line "    tandem …" with --print-config,
# which reads the options and the arguments but computes nothing.
cmake_minimum_required(VERSION 3.22)
file(REMOVE_RECURSE "${WORK}")
file(MAKE_DIRECTORY "${WORK}")

function(run)
  execute_process(COMMAND "${TANDEM}" ${ARGN} WORKING_DIRECTORY "${WORK}" OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
endfunction()

# The files and folders that the pages name.
foreach(name my_run run_1 run_2 run_3)
  file(COPY "${SOURCE}/share/scenarios/docking_a/" DESTINATION "${WORK}/${name}")
endforeach()
file(APPEND "${WORK}/my_run/scenario.yaml" "
sensors:
  radar: {type: range, file: radar.csv, sigma: [3.0]}
  lidar: {type: bearing, file: lidar.csv, sigma: [0.03, 0.03]}
  camera: {type: pose, file: camera.csv, sigma: [0.1, 0.1, 0.1, 0.04, 0.04, 0.04]}
")
file(WRITE "${WORK}/my_run/radar.csv" "t,range\n10,20\n")
file(WRITE "${WORK}/my_run/lidar.csv" "t,azimuth,elevation\n10,0.1,0.1\n")
file(COPY_FILE "${WORK}/my_run/optical.csv" "${WORK}/my_run/camera.csv")
file(WRITE "${WORK}/noise.yaml" "noise:\n  usbl: [1.9, 1.7, 1.6]\n")
file(WRITE "${WORK}/my_trial.yaml" "gap: 5\n")
file(WRITE "${WORK}/images.csv" "t\n10\n")
run(estimate my_run --max-keyframes 20 --no-covariance --plots off --quiet --out results --write-problem problem.json)
run(estimate my_run --max-keyframes 20 --no-covariance --plots off --quiet --out tuned)
file(COPY "${WORK}/noise.yaml" DESTINATION "${WORK}/tuned")
file(COPY_FILE "${WORK}/problem.json" "${WORK}/bug.json")

set(total 0)
file(GLOB pages "${SOURCE}/*.md" "${SOURCE}/docs/*.md" "${SOURCE}/docs/tutorials/*.md")
foreach(page IN LISTS pages)
  file(STRINGS "${page}" lines REGEX "^    (my_driver . )?tandem [a-z]" ENCODING UTF-8)
  foreach(line IN LISTS lines)
    if(line MATCHES "[[]|: |[A-Z][A-Z]+ |\\\\$") # usage lines, messages, and commands that continue on the next line
      continue()
    endif()
    string(REGEX REPLACE "^    (my_driver . )?tandem |( &&|#).*$" "" words "${line}")
    separate_arguments(words UNIX_COMMAND "${words}")
    execute_process(
      COMMAND "${TANDEM}" ${words} --print-config
      WORKING_DIRECTORY "${WORK}" RESULT_VARIABLE status OUTPUT_QUIET ERROR_VARIABLE error
    )
    if(NOT status EQUAL 0)
      message(SEND_ERROR "${page}:\n${line}\n${error}")
    endif()
    math(EXPR total "${total} + 1")
  endforeach()
endforeach()
if(total LESS 80)
  message(SEND_ERROR "only ${total} commands found in ${SOURCE}: is the pattern right?")
endif()
message(STATUS "${total} commands checked")
