# Target `docs`: Doxygen reference pages in docs/html of the build folder. Doxygen warnings are errors.
# Target `docs-notebooks`, if nbconvert is installed: the executed notebooks as pages in docs/html/notebooks. It is separate,
# because it needs the Python package and thereby all commands.
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

# The notebooks need an interpreter of the package's version.
foreach(candidate "${Python_EXECUTABLE}" /usr/bin/python3)
  if(TARGET tandem-python AND NOT TANDEM_NOTEBOOK_PYTHON AND EXISTS "${candidate}")
    execute_process(
      COMMAND "${candidate}" -c
              "import ipykernel, matplotlib, nbconvert, numpy, sys; sys.exit(sys.version_info[:2] != (${Python_VERSION_MAJOR}, ${Python_VERSION_MINOR}))"
      RESULT_VARIABLE result OUTPUT_QUIET ERROR_QUIET
    )
    if(result EQUAL 0)
      set(TANDEM_NOTEBOOK_PYTHON "${candidate}")
    endif()
  endif()
endforeach()
if(TANDEM_NOTEBOOK_PYTHON)
  file(GLOB notebooks CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/examples/python/*.ipynb")
  add_custom_target(
    docs-notebooks
    COMMAND
      "${CMAKE_COMMAND}" -E env "PYTHONPATH=${PROJECT_BINARY_DIR}/python" "${TANDEM_NOTEBOOK_PYTHON}" -m nbconvert --execute
      --to html --log-level WARN --output-dir "${TANDEM_DOCS_DIR}/html/notebooks" ${notebooks}
    COMMAND "${CMAKE_COMMAND}" -E echo "Notebooks: ${TANDEM_DOCS_DIR}/html/notebooks"
    VERBATIM
  )
  add_dependencies(docs-notebooks tandem-python)
endif()
