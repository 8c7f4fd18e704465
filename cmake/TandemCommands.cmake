# `tandem COMMAND` runs libexec/tandem/tandem-COMMAND, built from studies/commands/COMMAND_command.cpp. To add a
# command, add a file with a TANDEM_COMMAND line; no other list needs a change.

# Headings of `tandem --help`, in this order.
set(TANDEM_COMMAND_GROUPS "Estimation" "Models and noise" "Planning" "Studies" "Files")

# tandem_commands(RESULT folder BASE library BASE_FOLDERS folders ... FULL library LIBS libs ...): adds an executable
# for each command of the folder and sets RESULT to the targets' names. Commands that include only headers of the base
# folders link the base library; the others link the full library. Writes commands.inc, the list that `tandem --help`
# prints.
function(tandem_commands result folder)
  cmake_parse_arguments(ARG "" "BASE;FULL" "BASE_FOLDERS;LIBS" ${ARGN})
  file(GLOB files CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/${folder}/*_command.cpp")
  set(targets "")
  set(lines "")
  foreach(file ${files})
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${file}")
    file(READ "${file}" text)
    if(NOT text MATCHES "\nTANDEM_COMMAND\\(([a-z]+),[ \n]*\"([^\"]+)\",[ \n]*\"[^\"]+\"\\)")
      message(FATAL_ERROR "${file} has no line TANDEM_COMMAND(name, \"group\", \"summary\").")
    endif()
    string(STRIP "${CMAKE_MATCH_0}" line)
    set(name "${CMAKE_MATCH_1}")
    list(FIND TANDEM_COMMAND_GROUPS "${CMAKE_MATCH_2}" place)
    if(place EQUAL -1)
      message(FATAL_ERROR "${file}: the group \"${CMAKE_MATCH_2}\" is not among: ${TANDEM_COMMAND_GROUPS}.")
    endif()
    string(APPEND lines_${place} "${line}\n")
    add_executable(tandem-${name} "${file}" "${folder}/command_main.cpp")
    string(REGEX MATCHALL "#include <tandem/studies/[a-z_]+/" includes "${text}")
    list(TRANSFORM includes REPLACE "#include <tandem/studies/([a-z_]+)/" "\\1")
    list(REMOVE_ITEM includes ${ARG_BASE_FOLDERS})
    if(includes)
      target_link_libraries(tandem-${name} PRIVATE ${ARG_FULL} ${ARG_LIBS})
    else()
      target_link_libraries(tandem-${name} PRIVATE ${ARG_BASE} ${ARG_LIBS})
    endif()
    set_target_properties(tandem-${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/${TANDEM_INSTALL_LIBEXECDIR}")
    list(APPEND targets tandem-${name})
  endforeach()
  foreach(place RANGE 4)
    string(APPEND lines "${lines_${place}}")
  endforeach()
  file(CONFIGURE OUTPUT "${TANDEM_BUILD_INCLUDE_DIR}/tandem/commands.inc" CONTENT "${lines}" @ONLY)
  set(${result} ${targets} PARENT_SCOPE)
endfunction()

# tandem_man_pages(targets ...): adds the target tandem-man, which writes the man page of each program with its option
# `--reference man`, and installs the pages.
function(tandem_man_pages)
  find_program(TANDEM_GZIP gzip)
  mark_as_advanced(TANDEM_GZIP)
  if(CMAKE_CROSSCOMPILING OR NOT TANDEM_GZIP)
    message(STATUS "Man pages: OFF (they need gzip and a native build)")
    return()
  endif()
  set(folder "${PROJECT_BINARY_DIR}/${CMAKE_INSTALL_DATADIR}/man/man1")
  file(MAKE_DIRECTORY "${folder}")
  set(pages "")
  foreach(target ${ARGN})
    get_target_property(name ${target} OUTPUT_NAME)
    if(NOT name)
      set(name ${target})
    endif()
    set(page "${folder}/${name}.1")
    add_custom_command(
      OUTPUT "${page}.gz"
      COMMAND ${target} --reference man > "${page}"
      COMMAND "${TANDEM_GZIP}" -9nf "${page}"
      DEPENDS ${target} VERBATIM
    )
    list(APPEND pages "${page}.gz")
  endforeach()
  add_custom_target(tandem-man ALL DEPENDS ${pages})
  install(FILES ${pages} DESTINATION "${CMAKE_INSTALL_MANDIR}/man1" COMPONENT program OPTIONAL)
endfunction()
