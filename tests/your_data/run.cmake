# Makes the mistakes listed in docs/tutorials/your_recording.md and checks that TANDEM prints the messages quoted there.
cmake_minimum_required(VERSION 3.22)
set(scenario "${WORK}/my_run")
file(READ "${SOURCE}/docs/tutorials/your_recording.md" page)
set(settings
"name: my_run
noise:
  prior:          [0.001, 0.001, 0.001, 0.001, 0.001, 0.001]
  odometry:       [0.01, 0.01, 0.01, 0.0006, 0.0006, 0.0006]
  usbl:           [1.7, 1.7, 1.7]
  optical:        [0.14, 0.14, 0.14, 0.04, 0.04, 0.04]
  constant_twist: [0.15, 0.05, 0.05, 0.02, 0.02, 0.06]
  roll_pitch:     [0.04, 0.04]
")

function(fresh)
  file(REMOVE_RECURSE "${scenario}")
  file(MAKE_DIRECTORY "${scenario}")
  foreach(name chaser_odometry.tum usbl.csv optical.csv)
    file(COPY "${SOURCE}/share/scenarios/docking_a/${name}" DESTINATION "${scenario}")
  endforeach()
  file(WRITE "${scenario}/scenario.yaml" "${settings}")
endfunction()

# says(expected args ...): checks that tandem exits with status 1 and prints the message, and that the page quotes it.
function(says expected)
  execute_process(
    COMMAND "${TANDEM}" ${ARGN} WORKING_DIRECTORY "${WORK}" RESULT_VARIABLE status OUTPUT_VARIABLE out ERROR_VARIABLE out
  )
  string(FIND "${out}" "tandem: ${expected}\n" printed)
  string(FIND "${page}" "`${expected}`" documented)
  if(NOT status EQUAL 1 OR printed EQUAL -1)
    message(SEND_ERROR "tandem ${ARGN} must end with 1 and say\n  ${expected}\nbut ended with ${status}:\n  ${out}")
  elseif(documented EQUAL -1)
    message(SEND_ERROR "docs/tutorials/your_recording.md does not quote\n  ${expected}")
  endif()
endfunction()

# mistake(file pattern replacement expected): replaces the first match in the file of a fresh folder and checks the
# message of tandem estimate.
function(mistake file pattern replacement expected)
  fresh()
  file(READ "${scenario}/${file}" text)
  if(NOT text MATCHES "${pattern}")
    message(FATAL_ERROR "${file} has no ${pattern}")
  endif()
  string(FIND "${text}" "${CMAKE_MATCH_0}" at)
  string(LENGTH "${CMAKE_MATCH_0}" length)
  string(REGEX REPLACE "${pattern}" "${replacement}" changed "${CMAKE_MATCH_0}")
  string(SUBSTRING "${text}" 0 ${at} before)
  math(EXPR at "${at} + ${length}")
  string(SUBSTRING "${text}" ${at} -1 after)
  file(WRITE "${scenario}/${file}" "${before}${changed}${after}")
  says("${expected}" estimate my_run)
endfunction()

set(line "[^\n]*\n")
mistake(usbl.csv "^(${line}${line}${line}${line}[^\n]*)" "\\1,7"
        "my_run/usbl.csv:5: expected 4 columns (t,x,y,z), found 5")
mistake(usbl.csv "^${line}" ""
        "my_run/usbl.csv:1: the first line must be the header t,x,y,z, not '0.000,-17.876637,6.187475,4.654173'")
mistake(usbl.csv "^t,x,y,z" "t;x;y;z" "my_run/usbl.csv:1: the first line must be the header t,x,y,z, not 't;x;y;z'")
mistake(usbl.csv "^(${line}${line}${line}${line}${line}[^\n]*),[^\n]*" "\\1,abc"
        "my_run/usbl.csv:6: z is 'abc', not a number")
mistake(usbl.csv "^(${line}${line}${line})(${line})(${line})" "\\1\\3\\2"
        "my_run/usbl.csv:5: time 12.400 comes before that of line 4; lines must be in time order")
mistake(optical.csv "^(${line}${line}${line}[^,]*,[^,]*,[^,]*,[^,]*)[^\n]*" "\\1,0.5,0.5,0.5,0.9"
        "my_run/optical.csv:4: quaternion 0.5 0.5 0.5 0.9 has norm 1.249; it must be 1 within 0.001")
mistake(scenario.yaml "  usbl:${line}" "" "my_run/scenario.yaml:3: noise lacks the key usbl")
mistake(scenario.yaml "1.7, 1.7, 1.7" "1.7, 1.7" "my_run/scenario.yaml:5: usbl needs 3 standard deviations, not 2")
mistake(scenario.yaml "1.7, 1.7, 1.7" "1.7, 1.7, -1"
        "my_run/scenario.yaml:5: usbl has the standard deviation -1; it must be above zero and finite")
set(last "  roll_pitch:${line}")
set(sensor "\\0sensors:\n  sonar: ")
mistake(scenario.yaml "${last}" "${sensor}{type: sonar, file: sonar.csv, sigma: [1]}"
        "my_run/scenario.yaml:10: unknown sensor type 'sonar'")
mistake(scenario.yaml "${last}" "${sensor}{type: range, file: sonar.csv}"
        "my_run/scenario.yaml:10: sensor sonar lacks the key sigma")
mistake(scenario.yaml "${last}" "${sensor}{type: range, file: sonar.csv, sigma: [1]}" "my_run/sonar.csv is missing")
mistake(scenario.yaml "${last}" "${sensor}{type: range, file: sonar.csv, sgima: [1]}"
        "my_run/scenario.yaml:10: unknown key 'sgima' in sensor sonar; did you mean sigma?")
mistake(scenario.yaml "${last}" "\\0frame: NED\n" "my_run/scenario.yaml:9: unknown frame 'NED'")
mistake(scenario.yaml "  prior:" "\tprior:" "my_run/scenario.yaml:3: not valid yaml: illegal map value")
mistake(scenario.yaml "0.0006]" "0.0006" "my_run/scenario.yaml:5: not valid yaml: end of sequence flow not found")
mistake(scenario.yaml "noise:" "group: SE2\nnoise:"
        "my_run/usbl.csv:1: the first line must be the header t,x,y, not 't,x,y,z'")

fresh()
file(READ "${scenario}/usbl.csv" text)
string(REGEX REPLACE "\n([0-9]+)[.]([0-9][0-9][0-9])," "\n\\1\\2," text "${text}") # s to ms
file(WRITE "${scenario}/usbl.csv" "${text}")
says("my_run/usbl.csv:3: time 3700 is outside the time span of the odometry, 0 to 1200 s" estimate my_run)

fresh()
file(REMOVE "${scenario}/usbl.csv" "${scenario}/optical.csv")
says("my_run has no measurements of a target; give usbl.csv, optical.csv or another sensor with at least one row"
     estimate my_run)
fresh()
says("the noise constant_velocity is required; give positive standard deviations (found 0.000000)"
     estimate my_run --mode B)
says("docking_a has none of the chaser's own sensors (type imu, dvl, depth, gps or heading in scenario.yaml); use tandem \
estimate for a chaser with odometry" navigate docking_a)
says("gauss-newton takes soft residuals only, and this problem has 1537 hard ones: use augmented-lagrangian or ipopt, or \
nlopt for a small problem" estimate docking_a --non-holonomic hard --solver gauss-newton)
