#include <tandem/problem/planning/plan_problem_impl.hpp>

namespace tandem {

template struct Plan<3>;
template class PlanProblem<3>;

}  // namespace tandem
