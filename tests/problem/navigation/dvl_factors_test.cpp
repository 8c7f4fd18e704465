// Preintegration of DVL velocities between keyframes, for all orders and times of readings and keyframes.

#include <gtest/gtest.h>

#include <tandem/problem/navigation/dvl_factors.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/solvers/marginals.hpp>

namespace tandem {
namespace {

constexpr double kSigma = 0.02;   // m/s
constexpr double kPinned = 1e-6;  // rad, m

/// Keyframes on a straight course. Their orientations are known, so only the DVL determines the positions.
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
  DvlFactors::Context context() { return {problem, imu, sensors}; }
  void read(double t) { factors.add({t, Vector<3>(1, 0, 0), 0}, context()); }
  void keyframe(double t) {
    const SE3 at(SO3(), Vector<3>(t, 0, 0));
    keyframes.push_back({t, problem.add(at), Vector<3>::Zero()});
    const double position = keyframes.size() == 1 ? kPinned : 1e3;
    problem.minimize(Prior<SE3>{at}, Gaussian{position, position, position, kPinned, kPinned, kPinned},
                     {keyframes.back().pose});
    if (keyframes.size() > 1) factors.connect(keyframes[keyframes.size() - 2], keyframes.back(), context());
  }
  /// Returns the variance of the distance travelled to keyframe k [m²].
  double variance(std::size_t k) { return Marginals(problem).covariance(keyframes[k].pose)(0, 0); }
  int num_dvl_blocks() const { return problem.num_soft_blocks() - int(keyframes.size()); }
};

/// Adds a keyframe each second, and the readings that are `received`, in time order. Readings are at 0, k + 0.4 and
/// k + 0.43 s, so they hold for 0.03 or 0.97 s.
void run_to(
    StraightRun& run, int last, bool (*received)(double) = [](double) { return true; }) {
  const auto read = [&](double t) {
    if (received(t)) run.read(t);
  };
  for (int k = 0; k <= last; ++k) {
    run.keyframe(k);
    if (k == 0) read(0);
    if (k > 0) read(k + 0.4);
    read(k + 0.43);
  }
}

TEST(DvlFactors, SplitsReadingBetweenTwoFactors) {
  StraightRun run;
  run_to(run, 10);
  EXPECT_EQ(run.num_dvl_blocks(), 10);
  const double way = 0.43 * 0.43 + 9 * (0.97 * 0.97 + 0.03 * 0.03) + 0.57 * 0.57, expected = way * kSigma * kSigma;
  EXPECT_NEAR(run.variance(10), expected, 1e-6 * expected);
}

TEST(DvlFactors, ReadingHoldsForMaxAge) {
  StraightRun run;
  run_to(run, 10, [](double t) { return t < 3.5 || t > 8.42; });
  EXPECT_EQ(run.num_dvl_blocks(), 6) << "the reading at 3.43 s covers the factor to 5 s, but not that from 5 to 6 s";
  EXPECT_GT(run.variance(10), 1.0) << "m²; no factors between 5 and 9 s";
}

TEST(DvlFactors, HasNoFactorBeforeFirstReading) {
  StraightRun run;
  run_to(run, 3, [](double t) { return t > 0; });
  EXPECT_EQ(run.num_dvl_blocks(), 2);
}

TEST(DvlFactors, LateReadingsGiveSameFactors) {
  StraightRun in_time, late;
  run_to(in_time, 10);
  run_to(late, 10, [](double t) { return !(t > 2.42 && t < 4.5) && t != 7.4; });
  const double before = late.variance(10);
  for (const double t : {4.43, 2.43, 7.4, 3.43, 3.4, 4.4}) late.read(t);
  const double expected = in_time.variance(10);
  EXPECT_NEAR(late.variance(10), expected, 1e-9 * expected);
  EXPECT_GT(std::abs(before - expected), 0.1 * expected);
  EXPECT_EQ(late.num_dvl_blocks(), 10);
}

}  // namespace
}  // namespace tandem
