#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/studies/study/nees.hpp>

#include "studies/scratch.hpp"

namespace tandem {
namespace {

using testing::HasSubstr;

TEST(Nees, NormalisesErrorsByTheCovariance) {
  EgoCovariance covariance;
  covariance.pose = Vector<6>(4, 4, 4, 0.01, 0.01, 0.01).asDiagonal();
  covariance.velocity = 0.25 * Matrix<3, 3>::Identity();
  covariance.bias = Matrix<6, 6>::Identity();
  EgoState state;
  state.pose = SE3(SO3::Exp({0, 0, 1.0}), Vector<3>(1, 2, 3));
  const SE3 off =
      state.pose * SE3::Exp((Vector<6>() << 0, 0, 2, 0, 0, 0.2).finished());  // 1 σ in translation, 2 σ in rotation
  SE23::Columns columns;
  columns << off.translation(), Vector<3>(1, 0, 0);
  const EgoNees found = nees(SE23(off.rotation(), columns), Vector<6>::Constant(2), state, covariance);
  EXPECT_NEAR(found.pose, 1 + 4, 1e-9);
  EXPECT_NEAR(found.velocity, 4, 1e-12);
  EXPECT_NEAR(found.bias, 6 * 4, 1e-12);
}

/// Tables: the 2.5 and 97.5 % quantiles of χ² with 60 degrees of freedom are 40.482 and 83.298.
TEST(Nees, BandMatchesTabulatedQuantiles) {
  const auto [low, high] = chi_squared_band(6, 10);
  EXPECT_NEAR(low, 4.0482, 1e-4);
  EXPECT_NEAR(high, 8.3298, 1e-4);
}

/// A short version of bench_consistency. The band of 3.9 σ (99.99 %) makes a failure by chance a 1 in 1,000 event over
/// all instants and quantities; the seeds are fixed.
TEST(StatisticalNees, FixedLagIsConsistent) {
  constexpr int kRuns = 12;
  const std::vector<double> instants = {30, 60, 90};
  for (const Grade grade : {Grade::mems, Grade::tactical}) {
    std::vector<EgoNees> mean(instants.size());
    for (int run = 0; run < kRuns; ++run) {
      DiveOptions options{.grade = grade, .minutes = 2, .seed = std::uint64_t(run) + 1};
      options.dvl_scale = false;
      const std::vector<EgoNees> found = nees_of_fixed_lag(simulate_dive(options), instants, 20);
      for (std::size_t i = 0; i < instants.size(); ++i) {
        mean[i].pose += found[i].pose / kRuns;
        mean[i].velocity += found[i].velocity / kRuns;
        mean[i].bias += found[i].bias / kRuns;
      }
    }
    const auto expect_consistent = [&](double value, int rows, const char* what, double t) {
      EXPECT_NEAR(value, rows, 3.9 * std::sqrt(2.0 * rows / kRuns)) << what << " at " << t << " s, " << name(grade);
    };
    for (std::size_t i = 0; i < instants.size(); ++i) {
      expect_consistent(mean[i].pose, 6, "pose", instants[i]);
      expect_consistent(mean[i].velocity, 3, "velocity", instants[i]);
      expect_consistent(mean[i].bias, 6, "bias", instants[i]);
    }
  }
}

TEST(Nees, RejectsInstantThatIsNotReached) {
  const SimulatedDive dive = simulate_dive({.grade = Grade::tactical, .minutes = 1});
  EXPECT_THAT(error_of([&] { nees_of_fixed_lag(dive, {30, 100}, 20); }), HasSubstr("there is no keyframe at 100 s"));
}

}  // namespace
}  // namespace tandem
