# Target `docs`: Doxygen reference pages in docs/html of the build folder. Doxygen warnings are errors.
set(TANDEM_DOCS_DIR "${PROJECT_BINARY_DIR}/docs")
find_program(TANDEM_DOXYGEN doxygen)
mark_as_advanced(TANDEM_DOXYGEN)
if(TANDEM_DOXYGEN)
  configure_file("${CMAKE_CURRENT_LIST_DIR}/Doxyfile.in" "${TANDEM_DOCS_DIR}/Doxyfile" @ONLY)
  add_custom_target(
    docs
    COMMAND "${TANDEM_DOXYGEN}" "${TANDEM_DOCS_DIR}/Doxyfile"
    COMMAND "${CMAKE_COMMAND}" -E echo "Reference pages: ${TANDEM_DOCS_DIR}/html/index.html"
    WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}" VERBATIM
  )
else()
  add_custom_target(
    docs
    COMMAND "${CMAKE_COMMAND}" -E echo "docs: doxygen is not installed; install it and configure again."
    COMMAND "${CMAKE_COMMAND}" -E false
    VERBATIM
  )
endif()
