// Doppler velocities summed up between keyframes: what the chain makes of when they come.

#include <gtest/gtest.h>

#include <tandem/problem/navigation/dvl_factors.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/solvers/marginals.hpp>

namespace tandem {
namespace {

constexpr double kSigma = 0.02;   // m/s
constexpr double kPinned = 1e-6;  // rad, m

/// Keyframes each second on a straight course, whose orientations are known, so that positions come of the log alone.
struct StraightRun {
  Problem problem;
  ImuRecord imu{[] {
    ImuSensor sensor;
    sensor.noise.gyroscope = 1e-9;
    return sensor;
  }()};
  std::vector<EgoSensor> sensors{1};
  DvlFactors factors{2.0, Loss()};
  std::vector<DvlKeyframe> keyframes;

  StraightRun() {
    sensors[0].sigma = Vector<3>::Constant(kSigma);
    for (int i = 0; i <= 2000; ++i) imu.add({0.01 * i, Vector<3>(0, 0, 9.80665), Vector<3>::Zero()});
  }
  DvlFactors::Into into() { return {problem, imu, sensors}; }
  void read(double t) { factors.add({t, Vector<3>(1, 0, 0), 0}, into()); }
  void keyframe(double t) {
    const SE3 at(SO3(), Vector<3>(t, 0, 0));
    keyframes.push_back({t, problem.add(at), Vector<3>::Zero()});
    const double position = keyframes.size() == 1 ? kPinned : 1e3;  // far from certain but for the first
    problem.minimize(Prior<SE3>{at}, Gaussian{position, position, position, kPinned, kPinned, kPinned},
                     {keyframes.back().pose});
    if (keyframes.size() > 1) factors.tie(keyframes[keyframes.size() - 2], keyframes.back(), into());
  }
  /// Of the way to a keyframe, m².
  double variance(std::size_t k) { return Marginals(problem).covariance(keyframes[k].pose)(0, 0); }
  int log_blocks() const { return problem.num_soft_blocks() - int(keyframes.size()); }
};

/// In order of time; readings at k + 0.4 and k + 0.43, which so hold for 0.03 and 0.97 s, and a first one at 0.
void run_to(
    StraightRun& run, int last, bool (*heard)(double) = [](double) { return true; }) {
  const auto read = [&](double t) {
    if (heard(t)) run.read(t);
  };
  for (int k = 0; k <= last; ++k) {
    run.keyframe(k);
    if (k == 0) read(0);
    if (k > 0) read(k + 0.4);
    read(k + 0.43);
  }
}

TEST(DvlFactors, AReadingThatTwoFactorsShareCountsOnce) {
  StraightRun run;
  run_to(run, 10);
  EXPECT_EQ(run.log_blocks(), 10);
  const double way = 0.43 * 0.43 + 9 * (0.97 * 0.97 + 0.03 * 0.03) + 0.57 * 0.57, expected = way * kSigma * kSigma;
  EXPECT_NEAR(run.variance(10), expected, 1e-6 * expected);
}

TEST(DvlFactors, AReadingHoldsNoLongerThanItsGreatestAge) {
  StraightRun run;
  run_to(run, 10, [](double t) { return t < 3.5 || t > 8.42; });
  EXPECT_EQ(run.log_blocks(), 6) << "the reading at 3.43 s serves up to 5 s, the next one from 9 s on";
  EXPECT_GT(run.variance(10), 1.0) << "m²: nothing ties 5 s to 9 s";
}

TEST(DvlFactors, NothingIsKnownBeforeTheFirstReading) {
  StraightRun run;
  run_to(run, 3, [](double t) { return t > 0; });
  EXPECT_EQ(run.log_blocks(), 2);
}

TEST(DvlFactors, LateReadingsSayTheSame) {
  StraightRun in_time, late;
  run_to(in_time, 10);
  run_to(late, 10, [](double t) { return !(t > 2.42 && t < 4.5) && t != 7.4; });
  const double before = late.variance(10);
  for (const double t : {4.43, 2.43, 7.4, 3.43, 3.4, 4.4}) late.read(t);
  const double expected = in_time.variance(10);
  EXPECT_NEAR(late.variance(10), expected, 1e-9 * expected);
  EXPECT_GT(std::abs(before - expected), 0.1 * expected);
  EXPECT_EQ(late.log_blocks(), 10);
}

}  // namespace
}  // namespace tandem
