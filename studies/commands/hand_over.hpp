#pragma once

#include <string>

namespace tandem {

/// Becomes the program that has the command, with the same arguments, as the same process. `program` is its path in the
/// installation, or in the build, that this program is of. Throws Error where it cannot, which says what to do.
[[noreturn]] void hand_over(const std::string& command, const std::string& program, const char* const* argv);

}  // namespace tandem
