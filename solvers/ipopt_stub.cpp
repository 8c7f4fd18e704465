#include <tandem/solvers/ipopt.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem {

bool ipopt_available() { return false; }

std::string why_unsupported(const Problem&, const IpoptOptions&) {
  return "this build of Tandem is without Ipopt: install coinor-libipopt-dev and configure again";
}

Summary solve(Problem& problem, const IpoptOptions& options) {
  detail::Session session("ipopt", options);
  session.end(Status::unsupported, why_unsupported(problem, options));
  return session.summary;
}

}  // namespace tandem
