#pragma once

/// Where this build's own things are. CMake makes the source of them: as definitions on the command line they would make
/// every object of a test another one in another folder, and a compiler cache useless.
namespace tandem::paths {

extern const char* const source;      ///< this repository
extern const char* const shared;      ///< ../shared: reference values and recordings
extern const char* const executable;  ///< the command line, bin/tandem

}  // namespace tandem::paths
