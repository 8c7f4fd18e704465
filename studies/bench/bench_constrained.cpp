/// Solve time with hard constraints on docking_a (non-holonomic motion, limits of surge and yaw rate) from the standard
/// initial guess. Solves by augmented_lagrangian and Ipopt alternate, so that both have the same machine load. "ratio"
/// is the median time of Ipopt divided by that of augmented_lagrangian. Times include the sparsity pattern and the
/// symbolic analysis, but not building the problem.

#include <cmath>

#include <benchmark/benchmark.h>

#include <tandem/problem/quantile.hpp>
#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/ipopt.hpp>
#include <tandem/studies/scenario/scenario.hpp>

namespace {

using namespace tandem;

const TrackingData& docking_a() {
  static const Scenario scenario = read_scenario(TANDEM_SOURCE_DIR "/share/scenarios/docking_a");
  return scenario.data;
}

template <class Options>
Summary solve_from_start() {
  TrackingProblem tracking = make_tracking_problem(
      docking_a(), {.non_holonomic = Role::hard, .surge = between(0.0, 2.5), .max_yaw_rate = 0.3});
  return solve(tracking.problem, Options{});
}

void augmented_lagrangian_and_ipopt(benchmark::State& state) {
  std::vector<double> ours, theirs;
  for (auto _ : state) {
    const Summary a = solve_from_start<AugmentedLagrangianOptions>(), b = solve_from_start<IpoptOptions>();
    if (!a.converged() || !b.converged()) return state.SkipWithError("a solver did not converge");
    if (std::abs(a.cost - b.cost) > 1e-5 * b.cost) return state.SkipWithError("the costs differ");
    ours.push_back(a.seconds);
    theirs.push_back(b.seconds);
    state.counters["cost"] = a.cost;
    state.counters["cost_ipopt"] = b.cost;
    state.counters["iterations"] = a.iterations;
    state.counters["violation"] = a.max_violation;
    state.counters["evaluation_ms"] = 1e3 * a.evaluation_seconds;
    state.counters["linear_ms"] = 1e3 * a.linear_solver_seconds;
  }
  state.counters["ms"] = 1e3 * detail::median(ours);
  state.counters["ms_ipopt"] = 1e3 * detail::median(theirs);
  state.counters["ratio"] = detail::median(theirs) / detail::median(ours);
}

BENCHMARK(augmented_lagrangian_and_ipopt)->Unit(benchmark::kMillisecond)->UseRealTime()->Iterations(10);

}  // namespace

BENCHMARK_MAIN();
