#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Eigenvalues>

#include <tandem/solvers/calibration/log_constants.hpp>
#include <tandem/solvers/calibration/tail_term.hpp>

namespace tandem::detail {
namespace {

constexpr double kMinOtherShare = 1e-9;  // smallest share of the information that comes from other blocks

// Rows of a block in the eigenbasis of V; no allocation up to `Most` rows.
template <int Most>
using Array = Eigen::Array<double, Eigen::Dynamic, 1, 0, Most, 1>;
template <int Most>
using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, Most, Most>;

/// log ∫ N(e; mean, spread) t(e) de, and its derivatives.
template <int Most>
struct Smoothed {
  double value = 0;
  Array<Most> by_mean;
  Square<Most> by_covariance;
};

/// Integrates over the log of the precision, whose prior is Γ(c²/2, c²/2), by the trapezoidal rule. The rule is
/// accurate because the integrand is smooth and vanishes at both ends.
template <int Most>
Smoothed<Most> smoothed(double c2, const Array<Most>& mean, const Array<Most>& spread) {
  constexpr double kNegligible = 32;  // drop of the log integrand at the ends
  const double a = 0.5 * c2, far = kNegligible / a + std::sqrt(2 * kNegligible / a);
  const double low = -std::log1p(mean.matrix().squaredNorm() / c2) - far, high = std::log1p(far);
  std::array<double, 512> exponent, precision;
  const int nodes = std::min(2 + int((high - low) * std::sqrt(a + 1) / 0.35), int(exponent.size()));
  const double step = (high - low) / (nodes - 1);
  const Array<Most> squares = mean.square();
  double peak = -HUGE_VAL;
  for (int i = 0; i < nodes; ++i) {
    const double x = low + i * step, p = precision[std::size_t(i)] = std::exp(x);
    double wide = 0, pull = 0;
    for (Eigen::Index j = 0; j < mean.size(); ++j) {
      wide += std::log1p(p * spread[j]);
      pull += p * squares[j] / (1 + p * spread[j]);
    }
    exponent[std::size_t(i)] = a * (x - p) - 0.5 * (wide + pull);
    peak = std::max(peak, exponent[std::size_t(i)]);
  }
  const Eigen::Index n = mean.size();
  double sum = 0;
  Smoothed<Most> result{0, Array<Most>::Zero(n), Square<Most>::Zero(n, n)};
  for (int i = 0; i < nodes; ++i) {
    const double density = std::exp(exponent[std::size_t(i)] - peak), p = precision[std::size_t(i)];
    const Array<Most> K = p / (1 + p * spread), pulled = K * mean;
    sum += density;
    result.by_mean -= density * pulled;
    result.by_covariance.noalias() += (density * pulled.matrix()) * pulled.matrix().transpose();
    result.by_covariance.diagonal().array() -= density * K;
  }
  result.value = peak + a * std::log(a) + std::log(sum * step) - std::lgamma(a);
  result.by_mean /= sum;
  result.by_covariance *= 0.5 / sum;
  return result;
}

template <int Most>
TailTerm term_of(const Loss& loss, const Eigen::VectorXd& r, const Eigen::MatrixXd& V) {
  const double c2 = loss.scale * loss.scale, k = expected_curvature(loss), s = r.squaredNorm();
  const auto [rho, u, change_of_u] = loss(s);
  const double kappa = k * u;
  const Eigen::SelfAdjointEigenSolver<Square<Most>> eigen((Square<Most>(V)));
  const Square<Most>& Q = eigen.eigenvectors();
  const Array<Most> x = Q.transpose() * r;
  // The cavity distribution of e, N(mean, spread), given all other blocks; `left` is their share of the information.
  const Array<Most> variance = eigen.eigenvalues().array().max(0.0).min((1 - kMinOtherShare) / kappa);
  const Array<Most> left = 1 - kappa * variance, spread = variance / left;
  const Array<Most> mean = x * (1 + u * spread), d = mean - (1 - 1 / k) * x;  // d: distance from the mean of s
  const Array<Most> pull = kappa * left * d;
  const Smoothed<Most> t = smoothed<Most>(c2, mean, spread);

  TailTerm term;
  term.value = t.value + 0.5 * rho - 0.5 * u * s / k - 0.5 * left.log().sum() + 0.5 * (pull * d).sum();
  const Array<Most> both = t.by_mean + pull, scale = left.inverse();
  Square<Most> by_spread = both.matrix() * x.matrix().transpose();
  by_spread = (t.by_covariance + 0.5 * u * (by_spread + by_spread.transpose())).eval();
  Square<Most> by_covariance = scale.matrix().asDiagonal() * by_spread * scale.matrix().asDiagonal();
  by_covariance.diagonal().array() += 0.5 * kappa * scale;
  by_covariance.noalias() -= (0.5 * kappa * kappa * d.matrix()) * d.matrix().transpose();
  const double by_kappa = (by_spread.diagonal().array() * spread.square()).sum() + 0.5 * spread.sum() +
                          0.5 * ((left - kappa * variance) * d.square()).sum();
  const double by_u = k * by_kappa + (both * spread * x).sum();
  const double by_square = by_u * change_of_u + 0.5 * u - 0.5 * (change_of_u * s + u) / k;
  term.by_residual = Q * ((1 + u * spread) * t.by_mean + (1 / k + u * spread) * pull + 2 * by_square * x).matrix();
  term.by_covariance = Q * by_covariance * Q.transpose();
  return term;
}

}  // namespace

TailTerm tail_term(const Loss& loss, const Eigen::VectorXd& r, const Eigen::MatrixXd& V) {
  return r.size() <= 6 ? term_of<6>(loss, r, V) : term_of<Eigen::Dynamic>(loss, r, V);
}

}  // namespace tandem::detail
