# Finds SQLite, as target SQLite3::SQLite3 in the present folder.
find_package(SQLite3 REQUIRED)
if(NOT TARGET SQLite3::SQLite3)
  add_library(SQLite3::SQLite3 ALIAS SQLite::SQLite3) # its name before CMake 4.3
endif()
