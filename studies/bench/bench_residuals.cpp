/// One evaluation of each residual with all its Jacobians, and of the group operations under them.

#include <random>
#include <vector>

#include <benchmark/benchmark.h>

#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/roll_pitch.hpp>
#include <tandem/residuals/twist_components.hpp>
#include <tandem/residuals/usbl_position.hpp>

namespace {

using namespace tandem;

constexpr std::size_t kStates = 1024;  // a power of two; they fit the cache, as a sweep over blocks streams them

/// Poses some metres and up to `angle` radians apart from one to the next.
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
BENCHMARK_CAPTURE(evaluate, prior, Prior<SE3>{SE3()}, 0.3);

}  // namespace

BENCHMARK_MAIN();
