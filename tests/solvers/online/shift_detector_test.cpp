#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include <tandem/solvers/online/shift_detector.hpp>

namespace tandem::detail {
namespace {

/// Innovations of one component, with the lag-1 correlation `rho` and a mean.
class Innovations {
 public:
  explicit Innovations(unsigned seed, double rho = 0) : random_(seed), rho_(rho) {}

  std::optional<InnovationShift> next(double mean) {
    state_ = rho_ * state_ + std::sqrt(1 - rho_ * rho_) * normal_(random_);
    const double e = mean + state_;
    const auto shift = detector_.add(t_++, Vector<1>(e), usual_);
    usual_[0].add(e);
    return shift;
  }
  /// Returns the number of shifts in n innovations.
  int shifts(int n, double mean) {
    int found = 0;
    for (int i = 0; i < n; ++i) found += next(mean).has_value();
    return found;
  }
  bool is_shifted() const { return detector_.is_shifted(); }

 private:
  std::mt19937 random_;
  double rho_, state_ = 0, t_ = 0;
  std::normal_distribution<double> normal_;
  ShiftDetector detector_;
  std::vector<ResidualMoments> usual_{1};
};

TEST(ShiftDetector, UndisturbedInnovationsHaveNoShift) {
  for (unsigned seed = 0; seed < 20; ++seed) EXPECT_EQ(Innovations(seed).shifts(5000, 0), 0) << seed;
}

TEST(ShiftDetector, CorrelatedInnovationsHaveNoShift) {
  for (const double rho : {0.3, 0.6, 0.9})
    for (unsigned seed = 0; seed < 20; ++seed) EXPECT_EQ(Innovations(seed, rho).shifts(2000, 0), 0) << rho;
}

TEST(ShiftDetector, AConstantBiasFromTheStartIsUsual) {
  for (unsigned seed = 0; seed < 20; ++seed) EXPECT_EQ(Innovations(seed).shifts(1000, 0.5), 0) << seed;
}

TEST(ShiftDetector, FindsShiftsOfAnySignOnce) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    for (const auto& [mean, within] : {std::pair{1.2, 120}, {-1.5, 60}, {2.0, 25}, {-3.0, 12}, {4.5, 5}}) {
      Innovations innovations(seed);
      innovations.shifts(200, 0);
      std::optional<InnovationShift> shift;
      for (int i = 0; i < within && !shift; ++i) shift = innovations.next(mean);
      ASSERT_TRUE(shift) << "mean " << mean << ", seed " << seed;
      EXPECT_GT(shift->mean * mean, 0);
      EXPECT_NEAR(shift->since, 200, 20) << mean;
    }
  }
}

TEST(ShiftDetector, AShiftEnds) {
  Innovations innovations(1);
  innovations.shifts(200, 0);
  EXPECT_EQ(innovations.shifts(20, 3), 1);
  EXPECT_TRUE(innovations.is_shifted());
  EXPECT_EQ(innovations.shifts(40, 0), 0);
  EXPECT_FALSE(innovations.is_shifted());
}

}  // namespace
}  // namespace tandem::detail
