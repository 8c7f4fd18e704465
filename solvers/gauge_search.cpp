#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Eigenvalues>

#include <tandem/solvers/gauge_search.hpp>
#include <tandem/solvers/linear/jacobian_products.hpp>
#include <tandem/solvers/observability.hpp>

namespace tandem::detail {
namespace {

constexpr int kMaxCandidates = 6;       // Suspicious pivots that are tried.
constexpr double kMinDifference = 0.1;  // Difference of H and E along candidates that may be gauges.
constexpr int kMaxSteps = 150;          // Lanczos steps per candidate.
constexpr double kCurved = 0.1;         // Minimum eigenvalue of a direction that the exact Hessian observes.
constexpr double kMargin = 3;           // Distance from the eigenvalue of a gauge, in residuals of the eigenvector.
constexpr double kFlat = 1e-2;          // Maximum eigenvalue of a gauge.
constexpr double kResidual = 1e-3;      // Maximum residual of an eigenvector.
constexpr double kStep = 1e-3;          // Step of difference quotients [standard deviations].
constexpr double kMaxTurn = 0.3;        // Largest rotation in a finite move [rad].
constexpr int kMaxCorrections = 6;      // Steps back into the valley of the cost.
constexpr double kFar = 0.5;            // Part of the cost that a step removes, far from a minimum.
constexpr double kUnchanged = 1e-2;     // Change of the cost in a finite move, relative to the prediction by H.

class GaugeSearch {
 public:
  GaugeSearch(NlpEvaluator& nlp, const BlockCholesky& cholesky, const Eigen::VectorXd& weights,
              const std::vector<FlatDirection>& known, const Stop& stop)
      : nlp_(nlp),
        stop_(stop),
        cholesky_(cholesky),
        weights_(weights),
        ahead_(nlp.num_unknowns()),
        behind_(nlp.num_unknowns()),
        centre_(nlp.num_rows()),
        rows_(nlp.num_rows()),
        dual_(nlp.num_rows()),
        multipliers_(nlp.num_rows()),
        jacobian_(static_cast<Eigen::Index>(nlp.jacobian_pattern().row.size())) {
    for (const FlatDirection& flat : known) pinned_.push_back(flat.unknown);
    if (nlp_.num_rows() == 0) return;
    nlp_.constraints(centre_);
    nlp_.multipliers(multipliers_);
  }
  ~GaugeSearch() { nlp_.move_to(Eigen::VectorXd::Zero(nlp_.num_unknowns())); }
  GaugeSearch(const GaugeSearch&) = delete;
  GaugeSearch& operator=(const GaugeSearch&) = delete;

  /// Returns how much H and E differ along the sum of the candidates' directions H⁻¹ e, relative to H. Along a gauge,
  /// the difference is 1. `gradient` is that of the cost at X̄.
  double difference(const std::vector<int>& candidates, const Eigen::VectorXd& gradient_at_centre) {
    Eigen::VectorXd q = Eigen::VectorXd::Zero(nlp_.num_unknowns());
    for (const int unknown : candidates) {
      Eigen::VectorXd white = Eigen::VectorXd::Unit(q.size(), unknown);
      cholesky_.solve_lower(white);
      q += white.normalized();
    }
    deflate(q);
    if (!(q.norm() > 0)) return 0;
    q.normalize();
    if (nlp_.num_rows() > 0) return (product(q) - q).norm();
    Eigen::VectorXd v = q;
    cholesky_.solve_transposed(v);
    const double step = step_along(v);
    gradient(step * v, ahead_);
    Eigen::VectorXd w = (ahead_ - gradient_at_centre) / step;
    cholesky_.solve_lower(w);
    return (w - q).norm();
  }

  /// Returns whether a search has not converged.
  bool exhausted() const { return exhausted_; }

  /// Returns the gauge with the largest share in the direction H⁻¹ e of an unknown, or nothing.
  std::optional<Eigen::VectorXd> find(int unknown) {
    const Eigen::Index n = nlp_.num_unknowns();
    Eigen::VectorXd q = Eigen::VectorXd::Unit(n, unknown);
    cholesky_.solve_lower(q);
    deflate(q);
    if (!(q.norm() > 0)) return {};
    q.normalize();
    std::vector<Eigen::VectorXd> basis;
    Eigen::VectorXd diagonal(kMaxSteps), below(kMaxSteps);
    for (int k = 0; k < kMaxSteps && k < n; ++k) {
      stop_.check("observability");
      basis.push_back(q);
      Eigen::VectorXd w = product(q);
      deflate(w);
      diagonal[k] = q.dot(w);
      remove(basis, w);
      remove(basis, w);  // twice is enough for orthogonality to rounding
      below[k] = w.norm();
      if (!std::isfinite(below[k])) return {};
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen;
      eigen.computeFromTridiagonal(diagonal.head(k + 1), below.head(k));
      const double smallest = eigen.eigenvalues()[0], residual = below[k] * std::abs(eigen.eigenvectors()(k, 0));
      if (smallest - kMargin * residual > kCurved) return {};
      if (residual < kResidual || below[k] < kResidual) {
        if (smallest > kFlat) return {};
        Eigen::VectorXd white = Eigen::VectorXd::Zero(n);
        for (int i = 0; i <= k; ++i) white += eigen.eigenvectors()(i, 0) * basis[std::size_t(i)];
        Eigen::VectorXd v = white;
        cholesky_.solve_transposed(v);
        white_found_.push_back(white);
        if (!is_constant_along(v, white)) return {};
        return v.normalized();
      }
      q = w / below[k];
    }
    exhausted_ = true;
    return {};
  }

 private:
  /// Removes the known directions from white coordinates Lᵀ v. A pinned direction is a unit vector in these
  /// coordinates.
  void deflate(Eigen::VectorXd& white) const {
    for (const int unknown : pinned_) white[unknown] = 0;
    remove(white_found_, white);
  }
  static void remove(const std::vector<Eigen::VectorXd>& orthonormal, Eigen::VectorXd& v) {
    for (const Eigen::VectorXd& q : orthonormal) v -= q.dot(v) * q;
  }

  /// Cost with the active constraint rows, as an augmented Lagrangian about X̄.
  double cost(const Eigen::VectorXd& delta) {
    nlp_.move_to(delta);
    double sum = nlp_.cost();
    if (nlp_.num_rows() == 0) return sum;
    nlp_.constraints(rows_);
    for (Eigen::Index i = 0; i < rows_.size(); ++i) {
      if (weights_[i] == 0) continue;
      const double c = moved_row(i);
      sum += (nlp_.soft_weights()[i] > 0 ? 0.0 : multipliers_[i] * c) + 0.5 * weights_[i] * c * c;
    }
    return sum;
  }
  void gradient(const Eigen::VectorXd& delta, Eigen::VectorXd& g) {
    nlp_.move_to(delta);
    nlp_.gradient(g);
    if (nlp_.num_rows() == 0) return;
    nlp_.linearize_constraints(rows_, jacobian_);
    for (Eigen::Index i = 0; i < rows_.size(); ++i)
      dual_[i] =
          weights_[i] == 0 ? 0.0 : (nlp_.soft_weights()[i] > 0 ? 0.0 : multipliers_[i]) + weights_[i] * moved_row(i);
    add_transposed_product(nlp_.jacobian_pattern(), jacobian_, dual_, g);
  }
  /// Returns the distance of an active row from its value at X̄ or, for a soft bound, from the bound.
  double moved_row(Eigen::Index i) const {
    if (nlp_.soft_weights()[i] == 0) return rows_[i] - centre_[i];
    return centre_[i] < nlp_.lower()[i] ? rows_[i] - nlp_.lower()[i] : rows_[i] - nlp_.upper()[i];
  }

  static double step_along(const Eigen::VectorXd& v) { return kStep / std::max(1.0, v.cwiseAbs().maxCoeff()); }
  /// Returns L⁻¹ E L⁻ᵀ q, by central differences of the gradient.
  Eigen::VectorXd product(const Eigen::VectorXd& q) {
    Eigen::VectorXd v = q;
    cholesky_.solve_transposed(v);
    const double step = step_along(v);
    gradient(step * v, ahead_);
    gradient(-step * v, behind_);
    Eigen::VectorXd w = (ahead_ - behind_) / (2 * step);
    cholesky_.solve_lower(w);
    return w;
  }

  /// Returns whether the cost stays constant over a finite move. `white` = Lᵀ v has norm 1, so that H predicts a change
  /// of s²/2 for a move by s v.
  bool is_constant_along(const Eigen::VectorXd& v, const Eigen::VectorXd& white) {
    const double at_centre = cost(Eigen::VectorXd::Zero(v.size()));
    nlp_.move_to(v);
    const double size = std::min(1.0, kMaxTurn / std::max(nlp_.largest_angle(), kMaxTurn));
    double change = 0;
    for (const double sign : {1.0, -1.0}) {
      Eigen::VectorXd delta = sign * size * v;
      double here = cost(delta);
      for (int i = 0; i < kMaxCorrections && here - at_centre > 0.1 * kUnchanged * size * size; ++i) {
        gradient(delta, ahead_);
        cholesky_.solve_lower(ahead_);
        ahead_ -= white.dot(ahead_) * white;
        cholesky_.solve_transposed(ahead_);
        const double next = cost(delta - ahead_);
        if (!(next < here)) break;
        delta -= ahead_;
        here = next;
      }
      change += 0.5 * (here - at_centre);  // the mean over both sides removes the gradient at X̄
    }
    return std::abs(change) <= kUnchanged * size * size;
  }

  NlpEvaluator& nlp_;
  const Stop& stop_;
  const BlockCholesky& cholesky_;
  const Eigen::VectorXd& weights_;
  bool exhausted_ = false;
  std::vector<int> pinned_;                   // unknowns of the null directions of H
  std::vector<Eigen::VectorXd> white_found_;  // Lᵀ v of the directions found, orthonormal
  Eigen::VectorXd ahead_, behind_;
  Eigen::VectorXd centre_, rows_, dual_, multipliers_, jacobian_;
};

}  // namespace

std::vector<Eigen::VectorXd> gauges(NlpEvaluator& nlp, const BlockCholesky& cholesky, const Eigen::VectorXd& weights,
                                    const std::vector<FlatDirection>& known, const Eigen::VectorXd& gradient,
                                    const Stop& stop) {
  std::vector<int> candidates = cholesky.small_pivots(kSuspiciousPivot, kMaxCandidates);
  std::erase_if(candidates, [&](int unknown) {
    return std::any_of(known.begin(), known.end(), [&](const auto& flat) { return flat.unknown == unknown; });
  });
  std::vector<Eigen::VectorXd> found;
  if (candidates.empty()) return found;
  if (nlp.num_rows() == 0) {
    Eigen::VectorXd white = gradient;
    cholesky.solve_lower(white);
    for (const FlatDirection& flat : known)
      if (flat.unknown >= 0) white[flat.unknown] = 0;
    if (0.5 * white.squaredNorm() > kFar * nlp.cost()) return found;
  }
  GaugeSearch search(nlp, cholesky, weights, known, stop);
  if (!(search.difference(candidates, gradient) > kMinDifference)) return found;
  for (const int unknown : candidates) {
    if (std::optional<Eigen::VectorXd> gauge = search.find(unknown)) found.push_back(*std::move(gauge));
    if (search.exhausted()) break;
  }
  return found;
}

}  // namespace tandem::detail
