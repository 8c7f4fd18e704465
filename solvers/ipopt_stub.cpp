#include <tandem/solvers/ipopt.hpp>
#include <tandem/solvers/persistent_solve.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem {

bool ipopt_available() { return false; }

std::string why_unsupported(const Problem&, const IpoptOptions&) {
  return "this build of Tandem is without Ipopt: install coinor-libipopt-dev and configure again";
}

Summary solve(Problem& problem, const IpoptOptions& options) {
  return detail::rejection("ipopt", options, why_unsupported(problem, options));
}

std::unique_ptr<detail::PersistentSolve> detail::analyse(Problem&, const IpoptOptions&) { return nullptr; }

}  // namespace tandem
