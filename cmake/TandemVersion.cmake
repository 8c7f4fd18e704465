# Sets TANDEM_VERSION_TEXT to the version, with the commit in a git checkout, and generates version.hpp for C++.
set(TANDEM_COMMIT "")
find_package(Git QUIET)
if(Git_FOUND AND EXISTS "${PROJECT_SOURCE_DIR}/.git")
  execute_process(
    COMMAND "${GIT_EXECUTABLE}" rev-parse --short=10 HEAD WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}"
    OUTPUT_VARIABLE TANDEM_COMMIT OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET
  )
  set_property(DIRECTORY "${PROJECT_SOURCE_DIR}" APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/.git/HEAD")
endif()
set(TANDEM_VERSION_TEXT "${PROJECT_VERSION}")
if(TANDEM_COMMIT)
  string(APPEND TANDEM_VERSION_TEXT " (${TANDEM_COMMIT})")
endif()
configure_file("${CMAKE_CURRENT_LIST_DIR}/version.hpp.in" "${PROJECT_BINARY_DIR}/include/tandem/version.hpp" @ONLY)
install(FILES "${PROJECT_BINARY_DIR}/include/tandem/version.hpp" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/tandem" COMPONENT library)
