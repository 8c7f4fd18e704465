#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include <tandem/problem/navigation/imu_screen.hpp>

namespace tandem {
namespace {

constexpr double kStep = 0.01;  // s

ImuSample noisy_sample(int i) {
  static std::mt19937 generator(3);
  std::normal_distribution<double> noise(0, 0.02);
  const auto axis = [&](double mean) { return mean + noise(generator); };
  return {kStep * i, {axis(0.3 * std::sin(0.02 * i)), axis(0), axis(9.8)}, {axis(0), axis(0), axis(0.1)}};
}

/// Judges 600 samples, of which change(i, sample) may alter any. Returns the faults by sample.
template <class F>
std::vector<std::optional<ImuFault>> judged(F change, const ImuSensor& sensor = {}, double* longest_gap = nullptr) {
  ImuScreen screen(sensor);
  std::vector<std::optional<ImuFault>> faults;
  for (int i = 0; i < 600; ++i) {
    ImuSample sample = noisy_sample(i);
    change(i, sample);
    faults.push_back(screen.judge(sample));
    if (longest_gap && !faults.back()) *longest_gap = std::max(*longest_gap, sample.gap);
  }
  return faults;
}

std::size_t count(const std::vector<std::optional<ImuFault>>& faults) {
  return std::size_t(std::count_if(faults.begin(), faults.end(), [](const auto& f) { return f.has_value(); }));
}

TEST(ImuScreen, BelievesAnOrdinaryMotion) {
  EXPECT_EQ(count(judged([](int, ImuSample&) {})), 0u);
}

TEST(ImuScreen, SingleWrongSamplesOfAnySizeLeaveAGap) {
  for (const double wrong : {60.0, 100.0, 1e3, 1e5, 1e9, std::nan("")})
    for (const bool rate : {false, true}) {
      SCOPED_TRACE(::testing::Message() << wrong << ' ' << rate);
      double gap = 0;
      const auto faults = judged(
          [&](int i, ImuSample& s) {
            if (i == 300) (rate ? s.angular_rate : s.specific_force).x() = wrong;
          },
          {}, &gap);
      EXPECT_EQ(count(faults), 1u);
      EXPECT_TRUE(faults[300]);
      EXPECT_NEAR(gap, 2 * kStep, 1e-9);
    }
}

TEST(ImuScreen, ZerosShowNoGravity) {
  const auto faults = judged([](int i, ImuSample& s) {
    if (i >= 300 && i < 310) s.specific_force = s.angular_rate = Vector<3>::Zero();
  });
  EXPECT_EQ(count(faults), 10u);
  EXPECT_EQ(faults[305], ImuFault::no_gravity);
}

TEST(ImuScreen, AFrozenSensorIsNoticedWithinAQuarterOfASecond) {
  std::optional<ImuSample> held;
  const auto faults = judged([&](int i, ImuSample& s) {
    if (i < 300 || i >= 500) return;
    if (!held) held = s;
    s.specific_force = held->specific_force;
    s.angular_rate = held->angular_rate;
  });
  EXPECT_GE(count(faults), 200u - 25u);
  EXPECT_EQ(faults[400], ImuFault::frozen);
  EXPECT_FALSE(faults[510]);
}

TEST(ImuScreen, ABurstIsDiscardedAndALastingLevelIsBelieved) {
  const auto shifted = [](int first, int last, double by) {
    return judged([=](int i, ImuSample& s) {
      if (i >= first && i < last) s.specific_force.x() += by;
    });
  };
  EXPECT_EQ(count(shifted(300, 330, 200)), 30u);
  EXPECT_EQ(count(shifted(200, 600, 200)), 400u) << "no vehicle accelerates like this for long";
  const std::size_t discarded = count(shifted(300, 600, 25));
  EXPECT_GT(discarded, 0u);
  EXPECT_LE(discarded, 60u) << "a new level";
}

TEST(ImuScreen, ADeclaredRangeIsALimit) {
  ImuSensor sensor;
  sensor.max_angular_rate = 4;
  const auto faults = judged([](int i, ImuSample& s) { s.angular_rate.y() = i % 100 == 99 ? 7 : 3; }, sensor);
  EXPECT_EQ(count(faults), 6u);
  EXPECT_EQ(faults[99], ImuFault::out_of_range);
}

TEST(ImuScreen, ANoiseFreeSimulationIsNotFrozen) {
  EXPECT_EQ(count(judged([](int, ImuSample& s) {
              s.specific_force = {0, 0, 9.8};
              s.angular_rate = {0, 0, 0.1};
            })),
            0u);
}

TEST(ImuScreen, AGapMakesThePreintegrationLessCertain) {
  const ImuNoise noise{1e-3, 1e-4, 1e-5, 1e-6};
  const auto integrated = [&](double gap) {
    ImuPreintegrator sum({}, noise);
    sum.integrate(ImuSample{0, {0, 0, 9.8}, Vector<3>::Zero()}, ImuSample{0.1, {0, 0, 9.8}, Vector<3>::Zero(), gap});
    sum.integrate(ImuSample{0.1, {0, 0, 9.8}, Vector<3>::Zero()}, ImuSample{0.2, {0, 0, 9.8}, Vector<3>::Zero()});
    return Vector<15>(sum.covariance().diagonal().cwiseSqrt());
  };
  const Vector<15> certain = integrated(0), uncertain = integrated(0.1);
  EXPECT_NEAR(uncertain[3], 5 * 0.1 * 0.1 / 2, 2e-3) << "a jerk of 5 m/s^3 that interpolation misses";
  EXPECT_NEAR(uncertain[8], 1 * 0.1 * 0.1 / 2, 1e-3);
  EXPECT_LT(certain[3], 1e-3);
}

std::vector<ImuSample> noisy_samples() {
  std::vector<ImuSample> samples;
  for (int i = 0; i < 600; ++i) samples.push_back(noisy_sample(i));
  return samples;
}

TEST(ImuNeighbours, FindSingleSamplesThatTheLimitsOfTheScreenAccept) {
  for (const std::size_t wrong : {0, 3, 300, 599})
    for (const bool rate : {false, true}) {
      SCOPED_TRACE(::testing::Message() << wrong << ' ' << rate);
      std::vector<ImuSample> samples = noisy_samples();
      if (rate)
        samples[wrong].angular_rate.z() += 1.5;
      else
        samples[wrong].specific_force.x() -= 5;
      const auto faults = faults_beside_neighbours(samples);
      EXPECT_EQ(count(faults), 1u);
      EXPECT_EQ(faults[wrong], ImuFault::spike);
    }
}

TEST(ImuNeighbours, AcceptStepsAndOrdinaryMotion) {
  std::vector<ImuSample> samples = noisy_samples();
  for (std::size_t i = 300; i < 600; ++i) samples[i].angular_rate.z() += 2;
  EXPECT_EQ(count(faults_beside_neighbours(samples)), 0u);
  samples[200].specific_force.x() = std::nan("");  // ImuScreen names it
  EXPECT_EQ(count(faults_beside_neighbours(samples)), 0u);
}

TEST(ImuNeighbours, FindSamplesThatAreFrozenFromTheStart) {
  std::vector<ImuSample> samples = noisy_samples();
  for (std::size_t i = 1; i < 200; ++i) {
    samples[i] = samples[0];
    samples[i].t = kStep * double(i);
  }
  const auto faults = faults_beside_neighbours(samples);
  EXPECT_EQ(count(faults), 199u);
  EXPECT_EQ(faults[1], ImuFault::frozen);
  for (std::size_t i = 200; i < 600; ++i) {  // never changes: synthetic
    samples[i] = samples[0];
    samples[i].t = kStep * double(i);
  }
  EXPECT_EQ(count(faults_beside_neighbours(samples)), 0u);
}

}  // namespace
}  // namespace tandem
