/// Update time of FixedLag on a simulated tracking problem with one keyframe per second. Each keyframe has a chaser and
/// a target pose, odometry, a constant-twist residual and a roll-pitch prior. Every third keyframe has a target
/// position, every tenth a target pose and every twentieth a fix of the chaser. The initial guess is the dead-reckoned
/// chaser and the extrapolated target. Times cover the whole update: compilation, factorisation and marginalisation.
///   bench_fixed_lag [keyframes in the window = 75] [updates = 2000]

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <random>
#include <vector>

#include <tandem/lie/sek3.hpp>
#include <tandem/problem/quantile.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/roll_pitch.hpp>
#include <tandem/residuals/usbl_position.hpp>
#include <tandem/solvers/fixed_lag/fixed_lag.hpp>
#include <tandem/solvers/marginals.hpp>

namespace {

using namespace tandem;
using Clock = std::chrono::steady_clock;

/// Returns the processor time of this thread [ms]. On a busy machine, high percentiles of wall-clock time measure other
/// processes.
double processor_milliseconds() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * double(t.tv_sec) + 1e-6 * double(t.tv_nsec);
}
double milliseconds_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

void print(const char* what, const std::vector<double>& ms) {
  std::printf("%-28s p50 %8.4f ms   p99 %8.4f ms   max %8.4f ms\n", what, detail::quantile(ms, 0.5),
              detail::quantile(ms, 0.99), detail::quantile(ms, 1.0));
}

class SimulatedWindow {
 public:
  explicit SimulatedWindow(int keyframes) : lag_(options(keyframes)) {}
  SimulatedWindow(const SimulatedWindow&) = delete;

  /// Adds the data of one second.
  void add_second() {
    const double t = k_;
    const SE3 z = true_step_ * noisy(odometry_);
    if (k_ > 0) chaser_ = chaser_ * true_step_;
    if (k_ > 0) target_ = target_ * SE3::Exp(target_twist_) * noisy(0.1 * twist_, true);
    auto& problem = lag_.problem();
    c_.push_back(lag_.add(t, k_ == 0 ? chaser_ : problem.value(c_.back()) * z, "chaser"));
    t_.push_back(lag_.add(t, guess(), "target"));
    const std::size_t n = c_.size() - 1;
    if (k_ == 0) {
      problem.minimize(Prior<SE3>{chaser_}, sigmas(fix_), {c_[n]});
    } else {
      problem.minimize(RelativePose<SE3>{z}, sigmas(odometry_), {c_[n - 1], c_[n]});
    }
    if (k_ > 1) problem.minimize(ConstantTwist<SE3>{1.0, 1.0}, sigmas(twist_), {t_[n - 2], t_[n - 1], t_[n]});
    problem.minimize(RollPitch<SE3>{}, Gaussian{0.05, 0.05}, {t_[n]});
    const SE3 seen = chaser_.inverse() * target_;
    if (k_ % 10 == 0 || k_ < 3) {
      problem.minimize(RelativePose<SE3>{seen * noisy(optical_)}, sigmas(optical_), {c_[n], t_[n]});
    } else if (k_ % 3 == 0) {
      const Vector<3> e{normal_(random_), normal_(random_), normal_(random_)};
      problem.minimize(UsblPosition<SE3>{seen.translation() + e}, Gaussian{1.0, 1.0, 1.0}, {c_[n], t_[n]}, Cauchy(3.0));
    }
    if (k_ % 20 == 0) problem.minimize(Prior<SE3>{chaser_ * noisy(fix_)}, sigmas(fix_), {c_[n]});
    ++k_;
  }
  Summary update() {
    const Summary s = lag_.update();
    marginalising = milliseconds_since(leaving_);
    const auto gone = [&](const auto& x) { return !lag_.problem().has(x); };
    std::erase_if(c_, gone);
    std::erase_if(t_, gone);
    return s;
  }
  double marginalising = 0;  ///< duration of marginalisation in the last update [ms]
  double error() const { return minus(lag_.problem().value(t_.back()), target_).head<3>().norm(); }
  Matrix<12, 12> covariance() const { return lag_.covariance(c_.back(), t_.back()); }
  Matrix<12, 12> marginals_covariance() { return Marginals(lag_.problem()).joint(c_.back(), t_.back()); }
  FixedLag& lag() { return lag_; }

 private:
  FixedLagOptions options(int keyframes) {
    FixedLagOptions o;
    o.max_keyframes = keyframes;
    o.window = 1e9;
    o.before_marginalize = [this](double) { leaving_ = Clock::now(); };
    return o;
  }
  static Gaussian sigmas(const Vector<6>& s) { return Gaussian(Eigen::VectorXd(s)); }
  SE3 noisy(const Vector<6>& sigma, bool level = false) {
    Vector<6> v;
    for (int i = 0; i < 6; ++i) v[i] = sigma[i] * normal_(random_);
    if (level) v.segment<3>(2).setZero();
    return SE3::Exp(v);
  }
  SE3 guess() const {
    const auto& problem = lag_.problem();
    const std::size_t n = t_.size();
    if (n < 2) return target_;
    const SE3 &a = problem.value(t_[n - 2]), &b = problem.value(t_[n - 1]);
    return b * SE3::Exp(minus(b, a));  // b a⁻¹ b would double the rounding error of b's rotation at each keyframe
  }

  Clock::time_point leaving_;
  FixedLag lag_;
  std::mt19937_64 random_{7};
  std::normal_distribution<double> normal_;
  const SE3 true_step_ = SE3::Exp(Vector<6>(1.0, 0, 0, 0, 0, 0.01));
  const Vector<6> target_twist_{1.3, 0, 0, 0, 0, 0.009}, odometry_{0.01, 0.01, 0.01, 6e-4, 6e-4, 6e-4},
      twist_{0.15, 0.05, 0.05, 0.02, 0.02, 0.06}, optical_{0.1, 0.1, 0.1, 0.04, 0.04, 0.04},
      fix_{0.5, 0.5, 0.5, 0.02, 0.02, 0.02};
  SE3 chaser_, target_ = SE3(SO3(), Vector<3>(20, 5, 3));
  std::vector<Variable<SE3>> c_, t_;
  int k_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  const int keyframes = argc > 1 ? std::atoi(argv[1]) : 75, updates = argc > 2 ? std::atoi(argv[2]) : 2000;
  if (keyframes < 3 || updates < 1) {
    std::fprintf(stderr, "usage: bench_fixed_lag [KEYFRAMES >= 3] [UPDATES >= 1]\n");
    return 1;
  }
  SimulatedWindow run(keyframes);
  std::vector<double> update, processor, marginalising, linear, evaluation, covariance, marginals;
  double iterations = 0, error = 0;
  int failed = 0;
  for (int k = 0; k < keyframes + updates; ++k) {
    run.add_second();
    const auto begin = Clock::now();
    const double begin_processor = processor_milliseconds();
    const Summary s = run.update();
    const double ms = milliseconds_since(begin), processor_ms = processor_milliseconds() - begin_processor;
    failed += !s.converged();
    if (k < keyframes) continue;
    update.push_back(ms);
    processor.push_back(processor_ms);
    marginalising.push_back(run.marginalising);
    linear.push_back(1e3 * s.linear_solver_seconds);
    evaluation.push_back(1e3 * s.evaluation_seconds);
    iterations += s.iterations;
    error += run.error();
    const auto begin_covariance = Clock::now();
    const Matrix<12, 12> S = run.covariance();
    covariance.push_back(milliseconds_since(begin_covariance));
    if (!S.allFinite()) ++failed;
    if ((k - keyframes) % 20 == 0) {
      const auto begin_marginals = Clock::now();
      run.marginals_covariance();
      marginals.push_back(milliseconds_since(begin_marginals));
    }
  }
  auto& problem = run.lag().problem();
  std::printf("%d keyframes, %d blocks, %d unknowns; %.2f iterations per update, %d not converged, mean error %.2f m\n",
              keyframes, problem.num_soft_blocks(), problem.size().unknowns, iterations / updates, failed,
              error / updates);
  print("update", update);
  print("  processor time", processor);
  print("  residuals and Jacobians", evaluation);
  print("  factorising, solving", linear);
  print("  marginalising", marginalising);
  print("covariance of newest pair", covariance);
  print("  by Marginals", marginals);
  return failed > updates / 20;
}
