#include <cmath>
#include <random>
#include <utility>

#include <gtest/gtest.h>

#include <tandem/residuals/relative_pose.hpp>

#include "damped_point.hpp"

/// Coverage of the standard errors over many seeds.
namespace tandem::testing {
namespace {

struct Coverage {
  double within = 0;  ///< share of the seeds with the truth within two standard errors
  double mean = 0;    ///< mean error of the logarithm
};
template <class Find>
Coverage coverage(int seeds, double truth, Find find) {
  Coverage c;
  for (int seed = 0; seed < seeds; ++seed) {
    const auto [value, log_error] = find(unsigned(seed));
    const double off = std::log(value / truth);
    c.within += std::abs(off) <= 2 * log_error;
    c.mean += off / seeds;
  }
  c.within /= seeds;
  return c;
}

TEST(StatisticalCalibrateBuilt, TimeConstantsAreWithinTheirStandardErrors) {
  const Truth truths[] = {{4, 0.4, 3, 0.2, 0.2}, {10, 0.02, 3, 1.0, 0.2}};
  for (const int which : {0, 1}) {
    const Truth& truth = truths[which];
    const double true_time = which == 0 ? truth.twist_time : truth.error_time;
    const Coverage c = coverage(30, true_time, [&](unsigned seed) {
      const DampedPoint point(100 + seed, 500, truth);
      const auto found = calibrate_built(
          [&](const Eigen::VectorXd& values) {
            Eigen::VectorXd both = point.truth();
            both[which] = values[0];
            BuiltProblems built = point.build(both, true);
            built.groups = {built.groups[which == 0 ? 0 : 2], built.groups[1]};
            return built;
          },
          {{"time", 2.5 * true_time, 2}});
      EXPECT_TRUE(found.converged()) << found.message;
      EXPECT_TRUE(found.parameters[0].identifiable) << which << " " << seed;
      return std::pair{found.values[0], found.parameters[0].log_error};
    });
    EXPECT_GE(c.within, 0.9) << which;
    EXPECT_LE(std::abs(c.mean), 0.05) << which;
    RecordProperty(which == 0 ? "twist" : "error", std::to_string(c.within) + " " + std::to_string(c.mean));
  }
}

/// A random walk in two dimensions, measured with errors that follow Student's t.
struct HeavyTails {
  int n = 400;
  double dof = 4, walk = 0.2, seen = 1.0;
  std::vector<Vector<2>> z;

  HeavyTails(unsigned seed, double steps) : walk(steps) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    std::chi_squared_distribution<double> chi(dof);
    Vector<2> x = Vector<2>::Zero();
    for (int k = 0; k < n; ++k) {
      const double stretch = std::sqrt(dof / chi(random));
      z.push_back(x + seen * stretch * Vector<2>{normal(random), normal(random)});
      x += walk * Vector<2>{normal(random), normal(random)};
    }
  }
  BuiltProblems build(double given_dof) const {
    using R2 = Rn<2>;
    BuiltProblems built;
    auto problem = std::make_shared<Problem>();
    NoiseGroup fixes{"fixes", {}, 1.0}, steps{"steps", {}, 1.0};
    std::vector<Variable<R2>> x;
    for (const Vector<2>& fix : z) {
      x.push_back(problem->add(R2(fix)));
      fixes.rows.push_back({problem->minimize(Prior<R2>{R2(fix)}, {seen, seen}, {x.back()}, StudentT(given_dof, 2))});
      built.measured.push_back({fixes.rows.back().block});
      if (x.size() > 1)
        steps.rows.push_back({problem->minimize(RelativePose<R2>{R2()}, {walk, walk}, {x[x.size() - 2], x.back()})});
    }
    built.problems = {problem};
    built.groups = {fixes, steps};
    return built;
  }
};

/// The maximum likelihood estimate is biased by 8 % even at negligible leverage. At a leverage of 1/5, the bias must
/// not be larger.
TEST(StatisticalCalibrateBuilt, DegreesOfFreedomAreWithinTheirStandardErrors) {
  constexpr int kSeeds = 20;
  std::vector<Coverage> coverages;
  for (const double walk : {0.02, 0.5}) {
    double sigmas = 0;
    coverages.push_back(coverage(kSeeds, 4, [&](unsigned seed) {
      const HeavyTails tails(seed, walk);
      const auto found =
          calibrate_built([&](const Eigen::VectorXd& values) { return tails.build(values[0]); }, {{"dof", 8, 2}});
      EXPECT_TRUE(found.converged()) << found.message;
      // The scale of the t distribution; the noise is that of the Gaussian with the curvature of its peak.
      const double dof = found.values[0];
      sigmas += std::log(found.noise.noise[0].factor * std::sqrt((dof + 2) / dof)) / kSeeds;
      return std::pair{dof, found.parameters[0].log_error};
    }));
    EXPECT_GE(coverages.back().within, 0.9) << walk;
    EXPECT_LE(std::abs(sigmas), 0.04) << walk;
    RecordProperty("dof" + std::to_string(walk),
                   std::to_string(coverages.back().within) + " " + std::to_string(coverages.back().mean));
  }
  EXPECT_LE(std::abs(coverages[0].mean), 0.12);
  EXPECT_LE(std::abs(coverages[1].mean - coverages[0].mean), 0.08);
}

}  // namespace
}  // namespace tandem::testing
