#include <tandem/solvers/summary.hpp>

namespace tandem {

std::string_view name(Status status) {
  switch (status) {
    case Status::converged:
      return "converged";
    case Status::max_iterations:
      return "max-iterations";
    case Status::time_limit:
      return "time-limit";
    case Status::interrupted:
      return "interrupted";
    case Status::infeasible:
      return "infeasible";
    case Status::unconstrained:
      return "unconstrained";
    case Status::unsupported:
      return "unsupported";
    case Status::failed:
      return "failed";
  }
  return "failed";
}

std::string_view sentence(Status status) {
  switch (status) {
    case Status::converged:
      return "a local minimum was found to the tolerances asked for";
    case Status::max_iterations:
      return "the limit of iterations or evaluations was reached";
    case Status::time_limit:
      return "the time limit was reached";
    case Status::interrupted:
      return "the caller stopped it";
    case Status::infeasible:
      return "no point was found that meets all hard constraints";
    case Status::unconstrained:
      return "the problem leaves a direction of some variable free";
    case Status::unsupported:
      return "this solver cannot take the problem";
    case Status::failed:
      return "the numerics gave out";
  }
  return "the numerics gave out";
}

}  // namespace tandem
