#pragma once

#include <string>

namespace tandem {

/// The `tandem` program. Results go to standard output; errors, one sentence each, to standard error. Returns
/// the exit status: 0 the solver converged, 1 the input or the usage is wrong, 2 it did not converge (results
/// are written and say so).
int run_command_line(int argc, const char* const* argv, const std::string& version);

}  // namespace tandem
