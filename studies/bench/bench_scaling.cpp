/// Scaling of gauss_newton, and of augmented_lagrangian with hard constraints, on simulated problems of 1,000 to
/// 100,000 keyframes; gauss_newton also with 1,000,000. Time, time per iteration and memory should grow linearly. Peak
/// memory is measured for the whole process, so run one size at a time:
///   bench_scaling --benchmark_filter=gauss_newton/100000/

#include <random>

#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/gauss_newton.hpp>

namespace {

using namespace tandem;

constexpr int kFixInterval = 100;  // keyframes

/// Returns data of a chaser on a large circle and a target on a wider one, with a target position at every third
/// keyframe and a pose at every tenth. Odometry does not drift: with drift, a longer run would also be a harder
/// problem, because an early heading error rotates the whole trajectory.
TrackingData simulated_data(int keyframes) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  TrackingData data;
  data.noise.prior.setConstant(1e-3);
  data.noise.odometry << 0.01, 0.01, 0.01, 6e-4, 6e-4, 6e-4;
  data.noise.constant_twist << 0.15, 0.05, 0.05, 0.02, 0.02, 0.06;
  data.sensors.push_back({.name = "usbl", .type = SensorType::position, .sigma = Vector<3>::Constant(1.0)});
  data.sensors.push_back({.name = "optical", .type = SensorType::pose});
  data.sensors[1].sigma = Vector<6>(0.1, 0.1, 0.1, 0.04, 0.04, 0.04);
  const auto noisy = [&](Eigen::VectorXd v) {
    for (auto& x : v) x *= normal(random);
    return v;
  };
  const Vector<6> chaser_twist{1.0, 0, 0, 0, 0, 0.01}, target_twist{1.3, 0, 0, 0, 0, 0.009};
  SE3 chaser, target(SO3(), Vector<3>(20, 5, 3));
  for (int k = 0; k < keyframes; ++k) {
    data.odometry.push_back({double(k), chaser * SE3::Exp(noisy(data.noise.odometry))});
    const SE3 seen = chaser.inverse() * target;
    if (k % 10 == 0) {
      const SE3 z = seen * SE3::Exp(noisy(data.sensors[1].sigma));
      data.sensors[1].measurements.push_back({.t = double(k), .position = z.translation(), .rotation = z.rotation()});
    } else if (k % 3 == 0) {
      data.sensors[0].measurements.push_back(
          {.t = double(k), .position = seen.translation() + noisy(data.sensors[0].sigma)});
    }
    chaser = chaser * SE3::Exp(chaser_twist);
    Vector<6> disturbance = 0.1 * noisy(data.noise.constant_twist);
    disturbance.segment<3>(2).setZero();  // the target stays level, in agreement with the roll-pitch prior
    target = target * SE3::Exp(target_twist + disturbance);
  }
  return data;
}

/// Returns the problem of Mode A with a prior on the chaser's pose at every kFixInterval-th keyframe.
TrackingProblem problem_of(const TrackingData& data, const TrackingOptions& options) {
  TrackingProblem tracking = make_tracking_problem(data, options);
  for (std::size_t k = 0; k < tracking.chaser.size(); k += kFixInterval)
    tracking.problem.minimize(Prior<SE3>{tracking.chaser_pose(k)}, Gaussian{0.5, 0.5, 0.5, 0.02, 0.02, 0.02},
                              {std::get<Variable<SE3>>(tracking.chaser[k])});
  return tracking;
}

template <class Options>
void scaling(benchmark::State& state, const TrackingOptions& options) {
  const TrackingData data = simulated_data(static_cast<int>(state.range(0)));
  Summary summary;
  for (auto _ : state) {
    state.PauseTiming();
    TrackingProblem tracking = problem_of(data, options);
    state.ResumeTiming();
    summary = solve(tracking.problem, Options{});
    state.PauseTiming();
    tracking = {};
    state.ResumeTiming();
  }
  if (!summary.converged()) state.SkipWithError(summary.message.c_str());
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  state.counters["iterations"] = summary.iterations;
  state.counters["us_per_iteration_and_keyframe"] =
      1e6 * summary.seconds / std::max(1, summary.iterations) / double(state.range(0));
  state.counters["peak_MiB"] = double(usage.ru_maxrss) / 1024;
  state.SetComplexityN(state.range(0));
}

void gauss_newton(benchmark::State& state) { scaling<GaussNewtonOptions>(state, {}); }
void augmented_lagrangian(benchmark::State& state) {
  scaling<AugmentedLagrangianOptions>(state, {.non_holonomic = Role::hard, .surge = between(0.0, 2.5)});
}
void sizes(benchmark::internal::Benchmark* b) {
  for (const int keyframes : {1000, 3000, 10000, 30000, 100000}) b->Arg(keyframes);
  b->Unit(benchmark::kMillisecond)->UseRealTime()->Complexity(benchmark::oN);
}

BENCHMARK(gauss_newton)->Apply(sizes)->Arg(1000000);
BENCHMARK(augmented_lagrangian)->Apply(sizes);

}  // namespace

BENCHMARK_MAIN();
