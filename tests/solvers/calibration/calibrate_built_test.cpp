#include <cmath>
#include <numbers>
#include <random>
#include <tuple>
#include <utility>

#include <Eigen/Dense>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tandem/lie/error.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/residuals/biased.hpp>
#include <tandem/residuals/damped_twist.hpp>
#include <tandem/residuals/gauss_markov.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/solvers/calibration/built_evidence.hpp>
#include <tandem/solvers/calibration/calibrate_built.hpp>
#include <tandem/solvers/calibration/evidence.hpp>
#include <tandem/solvers/calibration/log_constants.hpp>

namespace tandem::testing {
namespace {

using ::testing::HasSubstr;
using Number = Rn<1>;

Number number(double x) { return Number(Vector<1>(x)); }

struct Truth {
  double twist_time = 10, twist = 0.1, error_time = 3, error = 1.0, seen = 0.2;
};
/// A point whose velocity is forgotten, seen with white noise and an error that is forgotten: linear and Gaussian.
struct DampedPoint : Truth {
  double begun = 5.0;  // of the first two positions
  std::vector<double> t, z;

  explicit DampedPoint(unsigned seed, int n = 200, const Truth& truth = {}) : Truth(truth) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform;
    double time = 0, before = begun * normal(random), x = before + 0.3 * normal(random), b = error * normal(random);
    for (int k = 0; k < n; ++k) {
      t.push_back(time);
      z.push_back((k == 0 ? before : x) + b + seen * normal(random));
      const double dt = 0.5 + uniform(random);
      if (k > 0) {
        const double dt1 = t[std::size_t(k)] - t[std::size_t(k) - 1];
        const auto twist_of = DampedTwist<Number>::over(dt1, dt, Vector<1>(twist_time));
        const double next = x + dt * twist_of.kept[0] * (x - before) / dt1 +
                            twist * DampedTwist<Number>::spread(dt1, dt, Vector<1>(twist_time))[0] * normal(random);
        before = x;
        x = next;
      }
      const auto step = GaussMarkov<1>::after(dt, error_time);
      b = step.kept * b + error * step.spread() * normal(random);
      time += dt;
    }
  }

  /// values: time constants of the velocity and of the error.
  BuiltProblems build(const Eigen::VectorXd& values, bool measured) const {
    BuiltProblems built;
    auto problem = std::make_shared<Problem>();
    NoiseGroup motion{"motion", {}, 0}, fixes{"fixes", {}, 0}, errors{"error", {}, 0};
    std::vector<Variable<Number>> x, b;
    for (std::size_t k = 0; k < t.size(); ++k) {
      x.push_back(problem->add(number(z[k])));
      b.push_back(problem->add(Number()));
      if (k < 2) problem->minimize(Prior<Number>{Number()}, {begun}, {x[k]});
      if (k >= 2) {
        const double dt1 = t[k - 1] - t[k - 2], dt2 = t[k] - t[k - 1];
        const Vector<1> time(values[0]);
        motion.rows.push_back(
            {problem->minimize(DampedTwist<Number>::over(dt1, dt2, time),
                               Gaussian(Eigen::VectorXd(twist * DampedTwist<Number>::spread(dt1, dt2, time))),
                               {x[k - 2], x[k - 1], x[k]})});
      }
      if (k == 0) {
        errors.rows.push_back({problem->minimize(Prior<Number>{Number()}, {error}, {b[0]})});
      } else {
        const auto step = GaussMarkov<1>::after(t[k] - t[k - 1], values[1]);
        errors.rows.push_back({problem->minimize(step, {error * step.spread()}, {b[k - 1], b[k]})});
      }
      fixes.rows.push_back({problem->minimize(Biased<Prior<Number>>{{number(z[k])}}, {seen}, {x[k], b[k]})});
      if (measured) built.measured.push_back({fixes.rows.back().block});
    }
    built.problems = {problem};
    built.groups = {motion, fixes, errors};
    return built;
  }
  Eigen::Vector2d truth() const { return {twist_time, error_time}; }

  /// The logarithm of the density of z, by a Kalman filter over two positions and the error.
  double exact(const Eigen::VectorXd& values, const Eigen::Vector3d& factors = Eigen::Vector3d::Ones()) const {
    const double q = twist * factors[0], r = seen * factors[1], s = error * factors[2];
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();  // x_k, x_{k−1}, b
    Eigen::Matrix3d P = Eigen::Vector3d(begun * begun, begun * begun, s * s).asDiagonal();
    const Eigen::RowVector3d H(1, 0, 1);
    double sum = 0;
    for (std::size_t k = 0; k < t.size(); ++k) {
      if (k > 0) {
        const double dt2 = t[k] - t[k - 1];
        Eigen::Matrix3d F = Eigen::Matrix3d::Zero(), Q = Eigen::Matrix3d::Zero();
        F(1, 0) = 1;
        if (k > 1) {
          const double dt1 = t[k - 1] - t[k - 2], share = dt2 / dt1 * std::exp(-0.5 * (dt1 + dt2) / values[0]);
          F(0, 0) = 1 + share;
          F(0, 1) = -share;
          Q(0, 0) = q * q * dt2 * dt2 * 0.5 * values[0] * (1 - std::exp(-(dt1 + dt2) / values[0]));
        } else {
          Q(0, 0) = begun * begun;  // the second position's own prior
        }
        const double kept = std::exp(-dt2 / values[1]);
        F(2, 2) = kept;
        Q(2, 2) = s * s * (1 - kept * kept);
        mean = (F * mean).eval();
        P = (F * P * F.transpose() + Q).eval();
      }
      const double S = H * P * H.transpose() + r * r, innovation = z[k] - H * mean;
      sum -= 0.5 * (innovation * innovation / S + std::log(2 * std::numbers::pi * S));
      const Eigen::Vector3d K = P * H.transpose() / S;
      mean += K * innovation;
      P = ((Eigen::Matrix3d::Identity() - K * H) * P).eval();
    }
    return sum;
  }
};

double evidence_of(const BuiltProblems& built) {
  Problem* const one[] = {built.problems[0].get()};
  CalibrationOptions options;
  options.measured = built.measured;
  options.whole_integral = true;
  const double constants = log_constants(one, built.measured);
  detail::Evidence evidence(one, built.groups, options);
  const auto value = evidence.at(Eigen::VectorXd::Zero(Eigen::Index(built.groups.size())));
  EXPECT_TRUE(value.usable) << value.why;
  return value.log_evidence + constants;
}

TEST(LogConstants, TheEvidenceOfProblemsByDifferentTimesIsAKalmanFiltersLikelihood) {
  const DampedPoint point(1, 80);
  const Eigen::Vector2d values[] = {{10, 3}, {1, 3}, {40, 12}, {0.2, 300}};
  for (const Eigen::Vector2d& at : values)
    EXPECT_NEAR(evidence_of(point.build(at, false)), point.exact(at), 1e-6 * std::abs(point.exact(at)));
}

TEST(LogConstants, SoItIsWhereBeliefsAreDividedByTheirIntegral) {
  DampedPoint point(1, 30);
  point.begun = 0.5;
  for (const Eigen::Vector2d& at : {Eigen::Vector2d(10, 3), Eigen::Vector2d(1, 3), Eigen::Vector2d(4, 300)}) {
    const BuiltProblems built = point.build(at, true);
    EXPECT_NEAR(evidence_of(built), point.exact(at), 1e-4)
        << "a millionth of the measurements' information is next to none";
    // Its gradient is that of the likelihood.
    Problem* const one[] = {built.problems[0].get()};
    CalibrationOptions options;
    options.measured = built.measured;
    options.whole_integral = true;
    detail::Evidence evidence(one, built.groups, options);
    const Eigen::Vector3d factors(0.2, -0.3, 0.4);
    const Eigen::VectorXd gradient = evidence.at(factors).gradient;
    for (int g = 0; g < 3; ++g) {
      const Eigen::Vector3d h = 1e-4 * Eigen::Vector3d::Unit(g);
      const Eigen::Vector3d up = (factors + h).array().exp(), down = (factors - h).array().exp();
      EXPECT_NEAR(gradient[g], (point.exact(at, up) - point.exact(at, down)) / 2e-4, 1e-3) << g;
    }
  }
}

TEST(LogConstants, StudentsDensityIntegratesToOne) {
  for (const double dof : {0.5, 3.0, 40.0})
    for (const int rows : {1, 2, 3}) {
      const Loss loss = StudentT(dof, rows);
      EXPECT_NEAR(degrees_of_freedom(loss, rows), dof, 1e-12);
      double integral = 0;  // over spheres of radius exp(u)
      const double area = 2 * std::pow(std::numbers::pi, 0.5 * rows) / std::tgamma(0.5 * rows), du = 1e-3;
      for (double u = -25; u < 60; u += du) {
        const double r = std::exp(u);
        integral += area * std::exp(rows * u - 0.5 * loss(r * r).rho + log_constant(loss, rows)) * du;
      }
      EXPECT_NEAR(integral, 1, 1e-6) << dof << " " << rows;
    }
  EXPECT_NEAR(log_constant(StudentT(1e6, 2), 2), log_constant({}, 2), 1e-5);
  EXPECT_THROW(log_constant({Loss::Kind::student_t, 1.0}, 3), Error);
}

TEST(CalibrateBuilt, FindsTheMaximumOfTheLikelihoodAndItsCurvature) {
  DampedPoint point(3, 800);
  point.error = 2;  // as given; a half is right
  const std::vector<BuiltParameter> parameters = {{"twist_time", 20, 0}, {"error_time", 8, 0}};
  const auto found =
      calibrate_built([&](const Eigen::VectorXd& values) { return point.build(values, false); }, parameters);
  ASSERT_TRUE(found.converged()) << found.message;
  // A Newton step of the exact likelihood over all five from there, and its inverse curvature.
  Eigen::VectorXd at(5);
  at << found.values.array().log().matrix(), std::log(found.noise.noise[0].factor),
      std::log(found.noise.noise[1].factor), std::log(found.noise.noise[2].factor);
  const auto f = [&](const Eigen::VectorXd& x) {
    const Eigen::VectorXd e = x.array().exp();
    return point.exact(e.head(2), e.tail<3>());
  };
  const double h = 1e-2;
  Eigen::VectorXd g(5);
  Eigen::MatrixXd H(5, 5);
  for (int i = 0; i < 5; ++i) {
    const Eigen::VectorXd ei = h * Eigen::VectorXd::Unit(5, i);
    g[i] = (f(at + ei) - f(at - ei)) / (2 * h);
    for (int j = 0; j < 5; ++j) {
      const Eigen::VectorXd ej = h * Eigen::VectorXd::Unit(5, j);
      H(i, j) = (f(at + ei + ej) - f(at + ei - ej) - f(at - ei + ej) + f(at - ei - ej)) / (4 * h * h);
    }
  }
  const Eigen::MatrixXd covariance = (-H).inverse();
  EXPECT_LE(0.5 * g.dot(covariance * g), 2e-3) << "what is left to gain";
  for (int i = 0; i < 2; ++i) {
    EXPECT_TRUE(found.parameters[std::size_t(i)].determined);
    EXPECT_NEAR(found.parameters[std::size_t(i)].log_error, std::sqrt(covariance(i, i)),
                0.1 * std::sqrt(covariance(i, i)));
  }
  for (int i = 0; i < 3; ++i)
    EXPECT_NEAR(found.noise.noise[std::size_t(i)].log_error, std::sqrt(covariance(2 + i, 2 + i)),
                0.1 * std::sqrt(covariance(2 + i, 2 + i)));
  Eigen::VectorXd given(5);
  given << std::log(20), std::log(8), 0, 0, 0;
  EXPECT_NEAR(found.gain, f(at) - f(given), 1e-3);
}

/// In how many of all seeds the truth is within two standard errors, and by how much the logarithm is off on average.
struct Coverage {
  double within = 0, mean = 0;
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

TEST(StatisticalCalibrateBuilt, TimesAreFoundWithinTheirStandardErrors) {
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
      EXPECT_TRUE(found.parameters[0].determined) << which << " " << seed;
      return std::pair{found.values[0], found.parameters[0].log_error};
    });
    EXPECT_GE(c.within, 0.9) << which;
    EXPECT_LE(std::abs(c.mean), 0.05) << which;
    RecordProperty(which == 0 ? "twist" : "error", std::to_string(c.within) + " " + std::to_string(c.mean));
  }
}

/// A slow random walk, seen in two components at once with errors of Student's t.
struct HeavyTails {
  int n = 400;
  double dof = 4, walk = 0.2, seen = 1.0;
  std::vector<Vector<2>> z;

  explicit HeavyTails(unsigned seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    std::chi_squared_distribution<double> chi(dof);
    Vector<2> x = Vector<2>::Zero();
    for (int k = 0; k < n; ++k) {
      const double stretch = std::sqrt(dof / chi(random));
      z.push_back(x + seen * stretch * Vector<2>(normal(random), normal(random)));
      x += walk * Vector<2>(normal(random), normal(random));
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

TEST(StatisticalCalibrateBuilt, DegreesOfFreedomAreFoundWithinTheirStandardErrors) {
  double sigmas = 0;
  constexpr int kSeeds = 30;
  const Coverage c = coverage(kSeeds, 4, [&](unsigned seed) {
    const HeavyTails tails(seed);
    const auto found =
        calibrate_built([&](const Eigen::VectorXd& values) { return tails.build(values[0]); }, {{"dof", 8, 2}});
    EXPECT_TRUE(found.converged()) << found.message;
    // The t's own scale, of which the noise of the peak's curvature is made.
    const double dof = found.values[0];
    sigmas += std::log(found.noise.noise[0].factor * std::sqrt((dof + 2) / dof)) / kSeeds;
    return std::pair{dof, found.parameters[0].log_error};
  });
  EXPECT_GE(c.within, 0.9);
  EXPECT_LE(std::abs(c.mean), 0.15) << "Laplace's approximation of what the states take finds some 12 % too many";
  EXPECT_LE(std::abs(sigmas), 0.03);
  RecordProperty("dof", std::to_string(c.within) + " " + std::to_string(c.mean) + " " + std::to_string(sigmas));
}

TEST(CalibrateBuilt, WhatTheDataDoNotTellKeepsWhatWasGiven) {
  DampedPoint point(5, 60);
  point.error = 1e-3;  // so little of it that its time shows in nothing
  const auto found = calibrate_built(
      [&](const Eigen::VectorXd& values) {
        BuiltProblems built = point.build(Eigen::Vector2d(10, values[0]), true);
        built.groups.clear();
        return built;
      },
      {{"error_time", 6, 1}});
  ASSERT_TRUE(found.converged());
  EXPECT_FALSE(found.parameters[0].determined || found.parameters[0].bounded);
  EXPECT_EQ(found.values[0], 6);
  EXPECT_LT(found.parameters[0].flat_from, 0.2);
  EXPECT_GT(found.parameters[0].flat_to, 5);
  EXPECT_TRUE(found.noise.noise.empty());
}

/// Built by times of the velocity and of the error, the noise as given.
BuiltProblems without_groups(const DampedPoint& point, const Eigen::VectorXd& values) {
  BuiltProblems built = point.build(values, true);
  built.groups.clear();
  return built;
}
BuiltProblems by_twist_time(const DampedPoint& point, double time) {
  return without_groups(point, Eigen::Vector2d(time, point.error_time));
}

TEST(CalibrateBuilt, SaysWhereProblemsEnd) {
  const DampedPoint point(3, 400);  // of 10 s
  int builds = 0, solvable = 0;
  const auto found = calibrate_built(
      [&](const Eigen::VectorXd& values) {
        ++builds;
        if (values[0] < 25) throw Error("too short");
        ++solvable;
        return by_twist_time(point, values[0]);
      },
      {{"twist_time", 60, 0}});
  EXPECT_EQ(found.status, Status::failed);
  EXPECT_THAT(found.message, HasSubstr("problems cannot be built or solved beyond twist_time = 2"));
  EXPECT_EQ(found.builds, builds);
  EXPECT_GE(found.solves, solvable) << "each is solved at least once";
  EXPECT_FALSE(found.parameters[0].determined) << "no datum ends its range below";
  EXPECT_TRUE(found.parameters[0].bounded);
  EXPECT_NEAR(found.values[0], 25, 1);
  EXPECT_GE(found.parameters[0].flat_from * 60, 25 - 1e-9);
}

TEST(CalibrateBuilt, TheEndOfProblemsFarFromTheMaximumMattersNotUnlessItEndsTheRange) {
  const DampedPoint point(3, 400);
  double least = 1;
  const auto find = [&] {
    return calibrate_built(
        [&](const Eigen::VectorXd& values) {
          if (values[0] < least) throw Error("too short");
          return by_twist_time(point, values[0]);
        },
        {{"twist_time", 20, 0}});
  };
  const auto free = find();
  ASSERT_TRUE(free.converged()) << free.message;
  ASSERT_TRUE(free.parameters[0].determined);
  least = 0.5 * (free.values[0] + 20 * free.parameters[0].flat_from);
  const auto cut = find();
  EXPECT_TRUE(cut.converged()) << cut.message;
  EXPECT_FALSE(cut.parameters[0].determined);
}

TEST(CalibrateBuilt, KeepsTheStatusOfASearchThatWasCutShort) {
  DampedPoint point(3, 200);
  point.error = 1e-3;  // its time is not told, and held
  CalibrationOptions options;
  options.max_iterations = 1;
  const auto found = calibrate_built([&](const Eigen::VectorXd& values) { return without_groups(point, values); },
                                     {{"twist_time", 200, 0}, {"error_time", 6, 1}}, options);
  EXPECT_FALSE(found.parameters[1].determined || found.parameters[1].bounded);
  EXPECT_EQ(found.status, Status::max_iterations) << found.message;
}

TEST(CalibrateBuilt, NeverBuildsBeyondBounds) {
  const DampedPoint point(3, 200);
  for (const auto& [given, least, most] : {std::tuple(10.0, 9.8, 10.2), {60.0, 25.0, 61.0}, {7.0, 7.0, 7.3}}) {
    double lowest = HUGE_VAL, highest = 0;
    CalibrationOptions options;
    options.profile = 5;
    const auto found = calibrate_built(
        [&](const Eigen::VectorXd& values) {
          lowest = std::min(lowest, values[0]);
          highest = std::max(highest, values[0]);
          return by_twist_time(point, values[0]);
        },
        {{"twist_time", given, 0, least, most}}, options);
    EXPECT_TRUE(found.converged()) << found.message;
    EXPECT_GE(lowest, least);
    EXPECT_LE(highest, most);
    EXPECT_GT(highest, lowest);
  }
}

TEST(CalibrateBuilt, SlopesAtABoundAreThoseWithoutIt) {
  const DampedPoint point(3, 200);
  const BuildProblems build = [&](const Eigen::VectorXd& values) { return by_twist_time(point, values[0]); };
  const CalibrationOptions options;
  const auto slopes = [&](double least, double given, double most) {
    const std::vector<BuiltParameter> parameters = {{"twist_time", given, 0, least, most}};
    detail::BuiltEvidence evidence(build, parameters, options);
    Calibration noise;
    double as_given;
    const auto here = evidence.first(noise, as_given);
    return evidence.derivatives(Eigen::VectorXd::Zero(1), here, 0);
  };
  const double h = 0.05, up = 20 * std::exp(h), down = 20 * std::exp(-h);  // the differences' step
  const double first = slopes(0, 20, HUGE_VAL).first;
  ASSERT_GT(std::abs(first), 1);
  EXPECT_NEAR(slopes(20, 20, HUGE_VAL).first, first, 0.01 * std::abs(first));
  EXPECT_NEAR(slopes(0, 20, 20).first, first, 0.01 * std::abs(first));
  EXPECT_NEAR(slopes(19.9, 20, 21).first, first, 0.01 * std::abs(first));
  EXPECT_EQ(slopes(20, 20, 20).first, 0);
  EXPECT_NEAR(slopes(20, 20, HUGE_VAL).second, slopes(0, up, HUGE_VAL).second, 1e-3) << "of the same three points";
  EXPECT_NEAR(slopes(0, 20, 20).second, slopes(0, down, HUGE_VAL).second, 1e-3);
}

/// There are no problems with one of the parameters as given, the other elsewhere.
BuildProblems not_one_as_given(const DampedPoint& point, const Eigen::Vector2d& given) {
  return [&point, given](const Eigen::VectorXd& values) {
    const Eigen::Vector2d off = (values.array() / given.array()).log().abs();
    if (off.minCoeff() < 0.01 && off.maxCoeff() > 0.2) throw Error("no such problem");
    return without_groups(point, values);
  };
}

TEST(CalibrateBuilt, AnUntoldParameterIsAsGivenAlsoWhereTheOthersCannotBeAsFoundThen) {
  DampedPoint point(5, 200);
  point.error = 0.05;
  const auto found = calibrate_built(not_one_as_given(point, {60, 12}), {{"twist_time", 60, 0}, {"error_time", 12, 0}});
  ASSERT_FALSE(found.parameters[0].determined || found.parameters[0].bounded);
  EXPECT_EQ(found.values[0], 60);
  EXPECT_EQ(found.parameters[0].factor, 1);
  EXPECT_TRUE(found.parameters[1].bounded);
  EXPECT_LT(found.values[1], 12);
  EXPECT_GE(found.values[1], 12 * std::exp(-0.2) - 1e-9) << "there are others with that one";
  EXPECT_THAT(found.message, HasSubstr("beyond error_time = 9.9"));
}

TEST(CalibrateBuilt, AGainThatCannotBeToldIsNone) {
  const DampedPoint point(3, 400);
  CalibrationOptions options;
  options.profile = 21;
  const auto found =
      calibrate_built(not_one_as_given(point, {30, 9}), {{"twist_time", 30, 0}, {"error_time", 9, 0}}, options);
  for (const CalibratedNoise& p : found.parameters) {
    EXPECT_NE(p.factor, 1);
    EXPECT_EQ(p.gain, 0);
    EXPECT_FALSE(p.profile.empty());
    for (const auto& [factor, fall] : p.profile) EXPECT_TRUE(std::isfinite(fall)) << factor;
  }
}

TEST(CalibrateBuilt, StopsWithTheBestSoFar) {
  const DampedPoint point(3, 200);
  std::atomic<bool> stop = false;
  CalibrationOptions options;
  options.stop = Stop(&stop);
  options.progress = [&](int, const Eigen::VectorXd& factors, double) { stop = factors.size() == 4; };
  const auto found =
      calibrate_built([&](const Eigen::VectorXd& values) { return point.build(Eigen::Vector2d(values[0], 3), true); },
                      {{"twist_time", 60, 0}}, options);
  EXPECT_EQ(found.status, Status::interrupted);
  EXPECT_GT(found.gain, 0);
  EXPECT_LT(found.values[0], 60);
  ASSERT_EQ(found.noise.noise.size(), 3u);
  EXPECT_NE(found.noise.noise[0].factor, 1);
}

TEST(CalibrateBuilt, SaysWhatIsWrong) {
  const DampedPoint point(3, 20);
  const auto build = [&](const Eigen::VectorXd& values) { return point.build(Eigen::Vector2d(values[0], 3), false); };
  const auto error = [&](const std::vector<BuiltParameter>& parameters) -> std::string {
    try {
      calibrate_built(build, parameters);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_THAT(error({}), HasSubstr("no parameter"));
  EXPECT_THAT(error({{"time", 0.0}}), HasSubstr("time is not given"));
  EXPECT_THAT(error({{"time", 6, 1, 10, 20}}), HasSubstr("within its bounds"));
}

}  // namespace
}  // namespace tandem::testing
