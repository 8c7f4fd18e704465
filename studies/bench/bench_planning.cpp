// Processor time of replans behind a moving target, for a torpedo-shaped vehicle and a hovering one.
//
//     bench_planning [STEPS] [REPLANS] [all] [steady]
//
// Without "all", only the torpedo-shaped vehicle runs. With "steady", the target's turn rate is constant. Without it,
// the turn rate changes each second, which moves the prediction at the end of H steps by a multiple of H².
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <random>

#include <tandem/problem/quantile.hpp>
#include <tandem/solvers/replanning/planner.hpp>
#include <tandem/studies/planning/vehicle_file.hpp>

namespace {

using namespace tandem;

/// Replans each second behind a slowly turning target. The chaser executes the first step with a small disturbance.
template <int N>
void run(const char* name, const VehicleModel<N>& model, const Vector<6>& most, PlanOptions options, PlanSolver solver,
         bool refine, int replans, double convert_noise_axes) {
  options.twist = Bounds<6>{-most, most};
  PlannerOptions planner_options;
  planner_options.solver = solver;
  planner_options.refine = refine;
  planner_options.pursuit.speed = 0.6 * most[0];
  Planner<N> planner(model, options, planner_options);
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  const Vector<3> current(0.05, 0.1, 0.0);
  Vector<6> twist, noise;
  twist << 0.5, 0.0, 0.0, 0.0, 0.0, 0.01;
  noise << 0.1, 0.02, 0.02, 0.01, 0.01, 0.02;
  SE3 target(SO3::Exp({0.0, 0.0, 0.4}), {40.0, 8.0, -11.0});
  VehicleState<N> state;
  state.pose = SE3(SO3(), {0.0, 0.0, -10.0});
  state.twist[0] = 0.5 * most[0];
  std::vector<double> milliseconds, iterations;
  double cold = 0.0, worst = 0.0;
  int refined = 0, accepted = 0;
  for (int k = 0; k <= replans; ++k) {
    const TargetPrediction prediction = predict_target({target * SE3::Exp(-twist), target, 1.0, Matrix<12, 12>::Zero()},
                                                       noise, options.dt, options.steps);
    const std::clock_t start = std::clock();
    const PlanResult<N> result = planner.replan(state, current, prediction);
    const double ms = 1e3 * double(std::clock() - start) / CLOCKS_PER_SEC;
    (k == 0 ? cold : milliseconds.emplace_back()) = ms;
    if (k > 0) {
      refined += result.summary.solver == "damped-sqp";
      accepted += result.accepted();
      worst = std::max(worst, result.max_violation);
      iterations.push_back(result.summary.iterations);
    }
    Vector<6> push;
    for (double& p : push) p = 0.01 * normal(random);
    state = result.plan.states[1];
    state.pose = state.pose * SE3::Exp(Vector<6>(push * options.dt));
    state.twist += 0.5 * push;
    twist[5] += convert_noise_axes * normal(random);
    target = target * SE3::Exp(Vector<6>(options.dt * twist));
  }
  std::printf(
      "%-16s %-22s %4d steps: cold %7.1f ms; warm median %7.2f, 99 %% %7.2f, worst %7.2f ms; %3.0f iterations; "
      "%d of %d by damped-sqp, %d accepted, violation %.1e\n",
      name, refine ? "damped-sqp first" : std::string(tandem::name(solver)).c_str(), options.steps, cold,
      detail::quantile(milliseconds, 0.5), detail::quantile(milliseconds, 0.99), detail::quantile(milliseconds, 1.0),
      detail::quantile(iterations, 0.5), refined, replans, accepted, worst);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) try {
  const int steps = argc > 1 ? std::atoi(argv[1]) : 50, replans = argc > 2 ? std::atoi(argv[2]) : 100;
  const auto asked = [&](std::string_view word) {
    return std::any_of(argv + std::min(argc, 3), argv + argc, [&](const char* given) { return word == given; });
  };
  const bool all = asked("all");
  const double convert_noise_axes = asked("steady") ? 0.0 : 0.004;
  PlanOptions options;
  options.steps = steps;
  options.goal = SE3(SO3(), {-4.0, 0.0, 0.0});
  options.keep_out = 3.0;
  options.lowest = -60.0;
  options.highest = -1.0;
  options.max_roll_pitch = 0.6;
  const Vehicle remus = read_vehicle("remus_100"), rov = read_vehicle("bluerov2_heavy");
  const auto& torpedo = std::get<VehicleModel<3>>(remus.model);
  const auto& hovering = std::get<VehicleModel<8>>(rov.model);
  const auto run_both = [&](PlanSolver solver, bool refine) {
    run("REMUS 100", torpedo, remus.most_twist, options, solver, refine, replans, convert_noise_axes);
    if (all) run("BlueROV2 Heavy", hovering, rov.most_twist, options, solver, refine, replans, convert_noise_axes);
  };
  run_both(PlanSolver::ipopt, true);
  run_both(PlanSolver::ipopt, false);
  run_both(PlanSolver::augmented_lagrangian, false);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "bench_planning: %s\n", error.what());
  return 1;
}
