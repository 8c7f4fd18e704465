#pragma once

#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include <Eigen/Dense>

#include <tandem/lie/rn.hpp>
#include <tandem/residuals/damped_twist.hpp>
#include <tandem/residuals/gauss_markov.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/with_bias.hpp>
#include <tandem/solvers/calibration/calibrate_built.hpp>

/// Linear problems built from time constants, and their exact likelihood.
namespace tandem::testing {

using Number = Rn<1>;

inline Number number(double x) { return Number(Vector<1>(x)); }

struct Truth {
  double twist_time = 10, twist = 0.1, error_time = 3, error = 1.0, fix_sigma = 0.2;
};
/// A point with damped velocity, measured with white noise and a time-correlated error. Linear and Gaussian.
struct DampedPoint : Truth {
  double initial_sigma = 5.0;  // standard deviation of the first two positions
  std::vector<double> t, z;

  explicit DampedPoint(unsigned seed, int n = 200, const Truth& truth = {}) : Truth(truth) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform;
    double time = 0, before = initial_sigma * normal(random), x = before + 0.3 * normal(random),
           b = error * normal(random);
    for (int k = 0; k < n; ++k) {
      t.push_back(time);
      z.push_back((k == 0 ? before : x) + b + fix_sigma * normal(random));
      const double dt = 0.5 + uniform(random);
      if (k > 0) {
        const double dt1 = t[std::size_t(k)] - t[std::size_t(k) - 1];
        const auto twist_of = DampedTwist<Number>::over(dt1, dt, Vector<1>(twist_time));
        const double next =
            x + dt * twist_of.decay[0] * (x - before) / dt1 +
            twist * DampedTwist<Number>::noise_scale(dt1, dt, Vector<1>(twist_time))[0] * normal(random);
        before = x;
        x = next;
      }
      const auto step = GaussMarkov<1>::after(dt, error_time);
      b = step.decay * b + error * step.noise_scale() * normal(random);
      time += dt;
    }
  }

  /// values: time constants of the velocity and of the error [s]. `measured`: fills BuiltProblems::measured.
  BuiltProblems build(const Eigen::VectorXd& values, bool measured) const {
    BuiltProblems built;
    auto problem = std::make_shared<Problem>();
    NoiseGroup motion{"motion", {}, 0}, fixes{"fixes", {}, 0}, errors{"error", {}, 0};
    std::vector<Variable<Number>> x, b;
    for (std::size_t k = 0; k < t.size(); ++k) {
      x.push_back(problem->add(number(z[k])));
      b.push_back(problem->add(Number()));
      if (k < 2) problem->minimize(Prior<Number>{Number()}, {initial_sigma}, {x[k]});
      if (k >= 2) {
        const double dt1 = t[k - 1] - t[k - 2], dt2 = t[k] - t[k - 1];
        const Vector<1> time(values[0]);
        motion.rows.push_back(
            {problem->minimize(DampedTwist<Number>::over(dt1, dt2, time),
                               Gaussian(Eigen::VectorXd(twist * DampedTwist<Number>::noise_scale(dt1, dt2, time))),
                               {x[k - 2], x[k - 1], x[k]})});
      }
      if (k == 0) {
        errors.rows.push_back({problem->minimize(Prior<Number>{Number()}, {error}, {b[0]})});
      } else {
        const auto step = GaussMarkov<1>::after(t[k] - t[k - 1], values[1]);
        errors.rows.push_back({problem->minimize(step, {error * step.noise_scale()}, {b[k - 1], b[k]})});
      }
      fixes.rows.push_back({problem->minimize(WithBias<Prior<Number>>{{number(z[k])}}, {fix_sigma}, {x[k], b[k]})});
      if (measured) built.measured.push_back({fixes.rows.back().block});
    }
    built.problems = {problem};
    built.groups = {motion, fixes, errors};
    return built;
  }
  Eigen::Vector2d truth() const { return {twist_time, error_time}; }

  /// Returns the log density of z by a Kalman filter over two positions and the error.
  double exact(const Eigen::VectorXd& values, const Eigen::Vector3d& factors = Eigen::Vector3d::Ones()) const {
    const double q = twist * factors[0], r = fix_sigma * factors[1], s = error * factors[2];
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();  // x_k, x_{k−1}, b
    Eigen::Matrix3d P =
        Eigen::Vector3d(initial_sigma * initial_sigma, initial_sigma * initial_sigma, s * s).asDiagonal();
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
          Q(0, 0) = q * q * dt2 * dt2 * -0.5 * values[0] * std::expm1(-(dt1 + dt2) / values[0]);
        } else {
          Q(0, 0) = initial_sigma * initial_sigma;  // prior of the second position
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

}  // namespace tandem::testing
