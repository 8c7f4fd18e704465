#pragma once

namespace tandem::python {

/// Ends forked processes at their exit, after Python's own end, without the destructors of libraries. Debian 13's Ipopt
/// has a destructor that finalises MPI and never returns in a forked process.
void end_forks_without_destructors();

}  // namespace tandem::python
