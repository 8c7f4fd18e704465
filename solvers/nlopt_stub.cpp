#include <tandem/solvers/nlopt.hpp>
#include <tandem/solvers/persistent_solve.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem {

std::vector<std::string> nlopt_algorithms() { return {}; }

std::string why_unsupported(const Problem&, const NloptOptions&) {
  return "this build of Tandem is without NLopt: install libnlopt-dev and libnlopt-cxx-dev and configure again";
}

Summary solve(Problem& problem, const NloptOptions& options) {
  return detail::rejection("nlopt:" + options.algorithm, options, why_unsupported(problem, options));
}

std::unique_ptr<detail::PersistentSolve> detail::analyse(Problem&, const NloptOptions&) { return nullptr; }

}  // namespace tandem
