/// Evaluation time of residuals with all their Jacobians, and of IMU preintegration.

#include <random>
#include <vector>

#include <benchmark/benchmark.h>

#include <tandem/residuals/auto_diff.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/dvl_velocity.hpp>
#include <tandem/residuals/imu_preintegration.hpp>
#include <tandem/residuals/preintegrated_imu.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/propagated.hpp>
#include <tandem/residuals/range_bearing.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/roll_pitch.hpp>
#include <tandem/residuals/testing.hpp>
#include <tandem/residuals/twist_components.hpp>
#include <tandem/residuals/usbl_position.hpp>

namespace {

using namespace tandem;

constexpr std::size_t kStates = 1024;  // a power of two; fits the cache

/// Returns random poses; consecutive ones differ by up to 1 m per axis and `angle` radians.
std::vector<SE3> random_poses(double angle) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> u(-1, 1);
  std::vector<SE3> poses{SE3()};
  while (poses.size() < kStates) {
    Vector<6> step;
    for (double& s : step) s = u(random);
    step.tail<3>() *= angle / std::sqrt(3.0);
    poses.push_back(poses.back() * SE3::Exp(step));
  }
  return poses;
}

template <class R>
void evaluate(benchmark::State& state, R residual, double angle) {
  constexpr int arity = std::tuple_size_v<typename R::States>;
  const auto poses = random_poses(angle);
  Vector<R::dim> r;
  std::array<Matrix<R::dim, 6>, arity> J;
  std::size_t i = 0;
  for (auto _ : state) {
    [&]<std::size_t... S>(std::index_sequence<S...>) { residual(poses[(i + S) % kStates]..., r, &J[S]...); }
    (std::make_index_sequence<arity>{});
    benchmark::DoNotOptimize(r);
    benchmark::DoNotOptimize(J);
    ++i;
  }
}

BENCHMARK_CAPTURE(evaluate, constant_twist_SE3, ConstantTwist<SE3>{1.0, 0.7}, 0.3);
BENCHMARK_CAPTURE(evaluate, constant_twist_SE3_wide, ConstantTwist<SE3>{1.0, 0.7}, 1.5);
BENCHMARK_CAPTURE(evaluate, relative_pose, RelativePose<SE3>{SE3()}, 0.3);
BENCHMARK_CAPTURE(evaluate, usbl_position, UsblPosition<SE3>{Vector<3>(1, 2, 3)}, 0.3);
BENCHMARK_CAPTURE(evaluate, roll_pitch, RollPitch<SE3>{}, 0.3);
BENCHMARK_CAPTURE(evaluate, non_holonomic, (TwistComponents<SE3, sway | heave>{1.0}), 0.3);

/// Evaluates a navigation residual, whose states are poses, velocities and biases in turn.
template <class R>
void evaluate_navigation(benchmark::State& state, R residual) {
  const auto poses = random_poses(0.3);
  std::vector<R3> velocities;
  std::vector<Rn<6>> biases;
  for (const SE3& pose : poses) {
    velocities.emplace_back(pose.translation());
    biases.emplace_back(0.01 * pose.Log());
  }
  const auto at = [&]<class X>(std::size_t i, const X*) -> const X& {
    if constexpr (std::is_same_v<X, SE3>)
      return poses[i % kStates];
    else if constexpr (std::is_same_v<X, R3>)
      return velocities[i % kStates];
    else
      return biases[i % kStates];
  };
  std::size_t i = 0;
  [&]<class... X>(const std::tuple<X...>*) {
    Vector<R::dim> r;
    std::tuple<Matrix<R::dim, X::dof>...> J;
    for (auto _ : state) {
      [&]<std::size_t... S>(std::index_sequence<S...>) {
        residual(at(i + S / 3, static_cast<const X*>(nullptr))..., r, &std::get<S>(J)...);
      }
      (std::index_sequence_for<X...>{});
      benchmark::DoNotOptimize(r);
      benchmark::DoNotOptimize(J);
      ++i;
    }
  }(static_cast<const typename R::States*>(nullptr));
}

/// Preintegrates one second of an IMU at 100 Hz with a lever arm.
ImuPreintegrator integrate_second() {
  ImuPreintegrator sum(SE3(SO3::Exp({0.1, 0.2, 0.3}), Vector<3>(0.5, 0, 0.2)), {1e-3, 1e-4, 1e-4, 1e-5, 1e-5});
  for (int i = 0; i < 100; ++i) sum.integrate({0.01 * i, 0.1, 9.8}, {0.1, 0.001 * i, -0.2}, 0.01);
  return sum;
}

void preintegrate_100_samples(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(integrate_second());
}

BENCHMARK_CAPTURE(evaluate_navigation, preintegrated_imu,
                  (PreintegratedImu{integrate_second().delta(), Earth::at_latitude(0.7, 9.81)}));
BENCHMARK_CAPTURE(evaluate_navigation, dvl_velocity, (DvlVelocity{Vector<3>(1, 0, 0)}));
BENCHMARK_CAPTURE(evaluate_navigation, propagated_dvl_velocity,
                  (Propagated{DvlVelocity{Vector<3>(1, 0, 0)}, integrate_second().delta()}));
BENCHMARK(preintegrate_100_samples);

/// Evaluates a residual at random states 0.5 from each other.
template <class R>
void evaluate_any(benchmark::State& state, R residual) {
  std::mt19937_64 random(1);
  std::vector<typename R::States> samples;
  while (samples.size() < 256) samples.push_back(random_states<typename R::States>(random, StateDistance::moderate));
  std::size_t i = 0;
  [&]<class... X>(const std::tuple<X...>*) {
    Vector<R::dim> r;
    std::tuple<RowsBy<R::dim, X>...> J;
    for (auto _ : state) {
      const auto& x = samples[i++ % samples.size()];
      [&]<std::size_t... S>(std::index_sequence<S...>) { residual(std::get<S>(x)..., r, &std::get<S>(J)...); }
      (std::index_sequence_for<X...>{});
      benchmark::DoNotOptimize(r);
      benchmark::DoNotOptimize(J);
    }
  }(static_cast<const typename R::States*>(nullptr));
}

// Closed forms and their automatic differentiation.
const ConstantTwist<SE3> kTwist{1.0, 0.7};
const ConstantTwist<SE2> kPlanarTwist{1.0, 0.7};
const RangeBearing<SE3, R3> kRangeBearing{9.0, Direction<3>(0.3, 0.1), SE3(SO3(), Vector<3>(1, 2, 3))};
BENCHMARK_CAPTURE(evaluate_any, constant_twist_SE3_closed_form, kTwist);
BENCHMARK_CAPTURE(evaluate_any, constant_twist_SE3_auto_diff, AutoDiff{kTwist});
BENCHMARK_CAPTURE(evaluate_any, constant_twist_SE2_closed_form, kPlanarTwist);
BENCHMARK_CAPTURE(evaluate_any, constant_twist_SE2_auto_diff, AutoDiff{kPlanarTwist});
BENCHMARK_CAPTURE(evaluate_any, range_bearing_closed_form, kRangeBearing);
BENCHMARK_CAPTURE(evaluate_any, range_bearing_auto_diff, AutoDiff{kRangeBearing});
BENCHMARK_CAPTURE(evaluate_any, usbl_position_closed_form, UsblPosition<SE3>{Vector<3>(1, 2, 3)});
BENCHMARK_CAPTURE(evaluate_any, usbl_position_auto_diff, AutoDiff{UsblPosition<SE3>{Vector<3>(1, 2, 3)}});
BENCHMARK_CAPTURE(evaluate, prior, Prior<SE3>{SE3()}, 0.3);

}  // namespace

BENCHMARK_MAIN();
