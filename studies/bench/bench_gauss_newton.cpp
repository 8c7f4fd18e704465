/// Solve time of Mode A on docking_a from the standard initial guess: gauss_newton against Ceres with SuiteSparse, with
/// the same residual code. The row "to_reference" stops at (1 + 1e-6) times the reference cost, "to_convergence" at the
/// solver's own tolerances. Times include the sparsity pattern and the symbolic analysis, but not building the problem.

#include <benchmark/benchmark.h>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/ipopt.hpp>
#include <tandem/studies/scenario/scenario.hpp>

#include "mode_a_ceres.hpp"

namespace {

using namespace tandem;

constexpr double kReferenceCost = 1726.416524 * (1 + 1e-6);

const TrackingData& docking_a() {
  static const Scenario scenario = read_scenario(TANDEM_SOURCE_DIR "/share/scenarios/docking_a");
  return scenario.data;
}

class StopAtReference final : public ceres::IterationCallback {
 public:
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& s) override {
    return s.cost <= kReferenceCost ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }
};

void ceres_solve(benchmark::State& state, bool to_reference) {
  bench::ModeACeres mode_a(docking_a());
  StopAtReference stop;
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
  options.num_threads = 2;
  options.max_num_iterations = 1000;
  options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 1e-10;
  if (to_reference) {
    options.callbacks.push_back(&stop);
    options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 1e-16;
  }
  ceres::Solver::Summary summary;
  for (auto _ : state) {
    state.PauseTiming();
    mode_a.reset();
    state.ResumeTiming();
    ceres::Solve(options, &mode_a.problem(), &summary);
  }
  state.counters["cost"] = summary.final_cost;
  state.counters["iterations"] = summary.num_successful_steps + summary.num_unsuccessful_steps;
}

template <class Options>
void tandem_solve(benchmark::State& state, bool to_reference) {
  Summary summary;
  for (auto _ : state) {
    state.PauseTiming();
    TrackingProblem mode_a = make_tracking_problem(docking_a());
    std::atomic<bool> stop = false;
    Options options;
    if (to_reference) {
      options.stop = &stop;
      options.progress = [&](const Progress& p) { stop = p.cost <= kReferenceCost; };
    }
    state.ResumeTiming();
    summary = solve(mode_a.problem, options);
    state.PauseTiming();
    benchmark::DoNotOptimize(mode_a);
    state.ResumeTiming();
  }
  state.counters["cost"] = summary.cost;
  state.counters["iterations"] = summary.iterations;
  if (to_reference && summary.status != Status::interrupted) state.SkipWithError("did not reach the reference cost");
  if (!to_reference && !summary.converged()) state.SkipWithError(summary.message.c_str());
}

void gauss_newton(benchmark::State& state, bool to_reference) { tandem_solve<GaussNewtonOptions>(state, to_reference); }
void ipopt(benchmark::State& state, bool to_reference) { tandem_solve<IpoptOptions>(state, to_reference); }

BENCHMARK_CAPTURE(gauss_newton, to_reference, true)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(ceres_solve, to_reference, true)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(gauss_newton, to_convergence, false)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(ceres_solve, to_convergence, false)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(ipopt, to_convergence, false)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace

BENCHMARK_MAIN();
