/// gauss_newton on a generated problem of 1,000 to 100,000 keyframes: seconds, seconds an iteration and memory must
/// grow linearly. Peak memory is the process's, so run one size at a time for it:
///   bench_scaling --benchmark_filter=/100000/

#include <random>

#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <tandem/problem/tracking.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/solvers/gauss_newton.hpp>

namespace {

using namespace tandem;

constexpr int kFixInterval = 100;  // keyframes

/// A chaser on a large circle and a target on a wider one, a position each third keyframe and a pose each tenth. The
/// odometry does not drift away, as that of a vehicle with an absolute reference: without one, a longer run is also a
/// harder one, since a first heading error swings a chain of any length.
TrackingData generated(int keyframes) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  TrackingData data;
  data.noise.prior.setConstant(1e-3);
  data.noise.odometry << 0.01, 0.01, 0.01, 6e-4, 6e-4, 6e-4;
  data.noise.constant_twist << 0.15, 0.05, 0.05, 0.02, 0.02, 0.06;
  data.position_sensors.push_back({});
  data.position_sensors[0].sigma.setConstant(1.0);
  data.pose_sensors.push_back({});
  data.pose_sensors[0].sigma << 0.1, 0.1, 0.1, 0.04, 0.04, 0.04;
  const auto noisy = [&](const auto& sigma) {
    auto v = sigma;
    for (auto& x : v) x *= normal(random);
    return v;
  };
  const Vector<6> chaser_twist{1.0, 0, 0, 0, 0, 0.01}, target_twist{1.3, 0, 0, 0, 0, 0.009};
  SE3 chaser, target(SO3(), Vector<3>(20, 5, 3));
  for (int k = 0; k < keyframes; ++k) {
    data.odometry.push_back({double(k), chaser * SE3::Exp(noisy(data.noise.odometry))});
    const SE3 seen = chaser.inverse() * target;
    if (k % 10 == 0) {
      data.pose_sensors[0].measurements.push_back({double(k), seen * SE3::Exp(noisy(data.pose_sensors[0].sigma))});
    } else if (k % 3 == 0) {
      data.position_sensors[0].measurements.push_back(
          {double(k), seen.translation() + noisy(data.position_sensors[0].sigma)});
    }
    chaser = chaser * SE3::Exp(chaser_twist);
    Vector<6> disturbance = 0.1 * noisy(data.noise.constant_twist);
    disturbance.segment<3>(2).setZero();  // the target floats level, as the roll-pitch prior says
    target = target * SE3::Exp(target_twist + disturbance);
  }
  return data;
}

/// Mode A, and a fix of the chaser's pose now and then.
TrackingProblem problem_of(const TrackingData& data) {
  TrackingProblem tracking = make_tracking_problem(data);
  for (std::size_t k = 0; k < tracking.chaser.size(); k += kFixInterval)
    tracking.problem.minimize(Prior<SE3>{tracking.problem.value(tracking.chaser[k])},
                              Gaussian{0.5, 0.5, 0.5, 0.02, 0.02, 0.02}, {tracking.chaser[k]});
  return tracking;
}

void scaling(benchmark::State& state) {
  const TrackingData data = generated(static_cast<int>(state.range(0)));
  Summary summary;
  for (auto _ : state) {
    state.PauseTiming();
    TrackingProblem tracking = problem_of(data);
    state.ResumeTiming();
    summary = solve(tracking.problem, GaussNewtonOptions{});
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

BENCHMARK(scaling)
    ->Arg(1000)
    ->Arg(3000)
    ->Arg(10000)
    ->Arg(30000)
    ->Arg(100000)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->Complexity(benchmark::oN);

}  // namespace

BENCHMARK_MAIN();
