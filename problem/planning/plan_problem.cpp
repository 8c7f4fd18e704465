#include <tandem/problem/planning/plan_problem.hpp>
#include <tandem/problem/planning/plan_problem_impl.hpp>

namespace tandem {

template struct Plan<3>;
template class PlanProblem<3>;
template struct Plan<8>;
template class PlanProblem<8>;

}  // namespace tandem
