#include <tandem/lie/error.hpp>
#include <tandem/studies/estimate.hpp>

namespace tandem {

Estimate estimate(const Scenario& scenario, const TrackingOptions& options, const Solver& solver) {
  TrackingProblem tracking = make_tracking_problem(scenario.data, options);
  Problem& problem = tracking.problem;

  Estimate result;
  result.scenario = scenario.name;
  result.residual_blocks = problem.num_soft_blocks();
  result.hard_blocks = problem.num_hard_blocks();
  result.summary = std::visit(
      [&](const auto& solver_options) {
        const std::string reason = why_unsupported(problem, solver_options);
        if (!reason.empty()) throw Error(reason);
        return solve(problem, solver_options);
      },
      solver);

  for (const Variable<SE3>& x : tracking.chaser) result.chaser.push_back(problem.value(x));
  for (const Variable<SE3>& x : tracking.target) result.target.push_back(problem.value(x));
  result.errors = keyframe_errors(scenario, tracking.keyframes, result.chaser, result.target);
  result.keyframes = std::move(tracking.keyframes);
  return result;
}

}  // namespace tandem
