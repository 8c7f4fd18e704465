#pragma once

/// Paths of this build. CMake generates their source file. As definitions on the command line they would differ between
/// build folders and make a compiler cache useless.
namespace tandem::paths {

extern const char* const source;      ///< this repository
extern const char* const shared;      ///< ../shared: reference values and recordings, may be absent
extern const char* const executable;  ///< bin/tandem

}  // namespace tandem::paths
