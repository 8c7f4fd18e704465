#include <algorithm>
#include <cmath>
#include <map>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/gauge_search.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>
#include <tandem/solvers/observability.hpp>

namespace tandem::detail {
namespace {

constexpr double kMinStiffness = 1e-22;  // ‖J v‖² relative to ‖J diag(v)‖²; rounding leaves about 1e-24
// Distance from its bound below which an inequality is active, in the units of the row.
constexpr double kActive = 1e-6;
// Participation of an unknown that counts, relative to the largest one. Null directions have 1e-8 by rounding, and
// gauges 1e-3, because an eigenvector is less accurate.
constexpr double kParticipates = 1e-6, kParticipatesInGauge = 1e-2;

/// Returns the weights of the rows. Active hard rows get the mean stiffness of the soft residuals, inactive
/// inequalities 0.
Eigen::VectorXd active_rows(NlpEvaluator& nlp, double stiffness, bool inequalities) {
  Eigen::VectorXd c(nlp.num_rows());
  nlp.constraints(c);
  for (Eigen::Index i = 0; i < c.size(); ++i) {
    if (const double w = nlp.soft_weights()[i]; w > 0) {  // a soft bound: its weight in the cost
      c[i] = c[i] < nlp.lower()[i] || c[i] > nlp.upper()[i] ? w : 0.0;
      continue;
    }
    const double away = std::min(c[i] - nlp.lower()[i], nlp.upper()[i] - c[i]);
    c[i] = away <= kActive && (inequalities || nlp.lower()[i] == nlp.upper()[i]) ? stiffness : 0.0;
  }
  return c;
}

}  // namespace

std::vector<FlatDirection> flat_directions(NlpEvaluator& nlp, bool inequalities, int most, const Stop& stop,
                                           int* skipped, Gauges with_gauges) {
  BlockCholesky cholesky(nlp.hessian_pattern());
  Eigen::VectorXd gradient(nlp.num_unknowns());
  Eigen::VectorXd hessian(nlp.hessian_pattern().nonzeros());
  return flat_directions(nlp, {cholesky, gradient, hessian}, inequalities, most, stop, skipped, with_gauges);
}

std::vector<FlatDirection> flat_directions(NlpEvaluator& nlp, const Workspace& work, bool inequalities, int most,
                                           const Stop& stop, int* skipped, Gauges with_gauges) {
  Eigen::VectorXd& hessian = work.hessian;
  Eigen::VectorXd weights;
  double size = 0.0;
  const ChunkedLoop parts(nlp.tasks(), hessian.size());
  const auto sum_of_sizes = [&] {
    return parts.sum([&](Eigen::Index begin, Eigen::Index size) { return hessian.segment(begin, size).lpNorm<1>(); });
  };
  std::vector<FlatDirection> flat;
  try {
    stop.check("observability");
    if (!work.has_hessian) nlp.linearize(work.gradient, hessian);
    size = sum_of_sizes();
    if (nlp.num_rows() > 0) {
      const double mean = size / double(nlp.num_unknowns());
      weights = active_rows(nlp, mean > 0 ? mean : 1.0, inequalities);
      Eigen::VectorXd jacobian(static_cast<Eigen::Index>(nlp.jacobian_pattern().row.size()));
      nlp.constraint_jacobian(jacobian);
      nlp.add_constraint_hessian(weights, jacobian, hessian);
      size = sum_of_sizes();
    }
    if (!std::isfinite(size)) return {};
    std::vector<int> unknowns;
    std::vector<Eigen::VectorXd> basis =
        work.cholesky.null_space(hessian, BlockCholesky::kRelativePivot, most, &unknowns);
    if (skipped) *skipped = int(unknowns.size() - basis.size());
    for (std::size_t i = 0; i < basis.size(); ++i) {
      const NlpEvaluator::Stiffness s = nlp.stiffness(basis[i], weights);
      flat.push_back({std::move(basis[i]), unknowns[i], s.along <= kMinStiffness * s.scale});
    }
    if (with_gauges == Gauges::search && static_cast<int>(basis.size()) < most) {
      for (Eigen::VectorXd& v : gauges(nlp, work.cholesky, weights, flat, work.gradient, stop))
        flat.push_back({std::move(v), -1, true});
    }
  } catch (const UndefinedResidualError&) {
  }
  return flat;
}

std::vector<UnobservableState> unobservable_states(const NlpEvaluator& nlp, const std::vector<FlatDirection>& flat,
                                                   int skipped) {
  constexpr double kNamed = 0.3;  // participation of a direction that is named, relative to the largest one
  std::vector<UnobservableState> states;
  std::map<std::string, std::map<int, std::string>> directions;  // variable -> tangent entry -> name of the direction
  for (const FlatDirection& direction : flat) {
    if (!direction.unobservable) continue;
    const double largest = direction.v.cwiseAbs().maxCoeff();
    for (Eigen::Index i = 0; i < direction.v.size(); ++i) {
      if (std::abs(direction.v[i]) < kNamed * largest) continue;
      const auto u = nlp.describe_unknown(static_cast<int>(i));
      if (!directions.contains(u.variable)) states.push_back({u.variable, {}});
      directions[u.variable][u.entry] = u.direction;
    }
  }
  for (UnobservableState& state : states)
    for (const auto& [entry, name] : directions[state.variable]) state.directions.push_back(name);
  if (!states.empty() && skipped > 0)
    states.push_back({"", {"up to " + std::to_string(skipped) + " further directions"}});
  return states;
}

std::vector<char> unobservable_unknowns(const std::vector<FlatDirection>& flat, const Eigen::VectorXd& curvature) {
  std::vector<char> found(std::size_t(curvature.size()), 0);
  for (const FlatDirection& direction : flat) {
    if (!direction.unobservable) continue;
    // An unknown without curvature takes part on its own.
    const Eigen::VectorXd scaled = direction.v.cwiseAbs().cwiseProduct(curvature.cwiseMax(0.0).cwiseSqrt());
    const double least = (direction.unknown < 0 ? kParticipatesInGauge : kParticipates) * scaled.maxCoeff();
    const double alone = kParticipates * direction.v.cwiseAbs().maxCoeff();
    for (Eigen::Index i = 0; i < curvature.size(); ++i)
      if (curvature[i] > 0 && scaled.maxCoeff() > 0 ? scaled[i] > least : std::abs(direction.v[i]) > alone)
        found[std::size_t(i)] = 1;
  }
  return found;
}

}  // namespace tandem::detail
