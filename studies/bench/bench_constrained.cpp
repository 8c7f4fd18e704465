/// Solve time under hard constraints on docking_a (non-holonomic motion, surge and yaw rate limited) from the standard
/// start: augmented_lagrangian beside Ipopt, in turns, so that both meet the same load. "ratio" is Ipopt's time over
/// augmented_lagrangian's, medians of the pairs. The time includes compiling the pattern and the symbolic analysis, not
/// building the problem.

#include <algorithm>
#include <cmath>

#include <benchmark/benchmark.h>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/ipopt.hpp>
#include <tandem/studies/scenario/scenario.hpp>

namespace {

using namespace tandem;

const TrackingData& docking_a() {
  static const Scenario scenario = read_scenario(TANDEM_SOURCE_DIR "/studies/scenarios/docking_a");
  return scenario.data;
}

template <class Options>
Summary solve_from_start() {
  TrackingProblem tracking = make_tracking_problem(
      docking_a(), {.non_holonomic = Role::hard, .surge = between(0.0, 2.5), .max_yaw_rate = 0.3});
  return solve(tracking.problem, Options{});
}

double median(std::vector<double> v) {
  std::nth_element(v.begin(), v.begin() + std::ptrdiff_t(v.size() / 2), v.end());
  return v[v.size() / 2];
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
  state.counters["ms"] = 1e3 * median(ours);
  state.counters["ms_ipopt"] = 1e3 * median(theirs);
  state.counters["ratio"] = median(theirs) / median(ours);
}

BENCHMARK(augmented_lagrangian_and_ipopt)->Unit(benchmark::kMillisecond)->UseRealTime()->Iterations(10);

}  // namespace

BENCHMARK_MAIN();
