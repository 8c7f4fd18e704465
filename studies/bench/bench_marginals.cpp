/// Time of Marginals on docking_a at its optimum: linearisation, factorisation, selected inversion, and the joint
/// covariance of chaser and target at every keyframe, without constraints and with the hard non-holonomic constraint.

#include <benchmark/benchmark.h>

#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/solvers/relative_covariance.hpp>
#include <tandem/studies/scenario/scenario.hpp>

namespace {

using namespace tandem;

template <class Any>
const Variable<SE3>& pose(const Any& variable) {
  return std::get<Variable<SE3>>(variable);
}

void marginals(benchmark::State& state, Role non_holonomic, bool pairs_outside) {
  const Scenario scenario = read_scenario(TANDEM_SOURCE_DIR "/share/scenarios/docking_a");
  TrackingProblem soft = make_tracking_problem(scenario.data);
  if (!solve(soft.problem, GaussNewtonOptions{}).converged()) state.SkipWithError("no optimum");
  TrackingOptions options;
  options.non_holonomic = non_holonomic;
  TrackingProblem tracking = make_tracking_problem(scenario.data, options);
  const std::size_t n = tracking.keyframes.size();
  for (std::size_t k = 0; k < n; ++k) {
    tracking.problem.set_value(pose(tracking.chaser[k]), soft.problem.value(pose(soft.chaser[k])));
    tracking.problem.set_value(pose(tracking.target[k]), soft.problem.value(pose(soft.target[k])));
  }
  const auto relative = [&](const Marginals& marginals, std::size_t c, std::size_t t) {
    const auto &chaser = pose(tracking.chaser[c]), &target = pose(tracking.target[t]);
    return relative_pose_covariance(tracking.problem.value(chaser), tracking.problem.value(target),
                                    marginals.joint(chaser, target))
        .trace();
  };
  if (pairs_outside) {
    const Marginals marginals(tracking.problem);
    for (auto _ : state) benchmark::DoNotOptimize(relative(marginals, 0, n - 1));
    return;
  }
  std::size_t outside = 0;
  for (auto _ : state) {
    const Marginals marginals(tracking.problem);
    double trace = 0;
    outside = 0;
    for (std::size_t k = 0; k < n; ++k) {
      trace += relative(marginals, k, k);
      outside += !marginals.in_pattern(pose(tracking.chaser[k]), pose(tracking.target[k]));
    }
    benchmark::DoNotOptimize(trace);
  }
  state.counters["keyframes"] = double(n);
  state.counters["pairs_outside_pattern"] = double(outside);
}

BENCHMARK_CAPTURE(marginals, soft, Role::off, false)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(marginals, non_holonomic, Role::hard, false)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(marginals, first_and_last_keyframe, Role::off, true)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace

BENCHMARK_MAIN();
