#include <cmath>
#include <map>
#include <vector>

#include <tandem/solvers/observability.hpp>

namespace tandem::detail {
namespace {

constexpr double kMinStiffness = 1e-20;  // ‖J v‖² relative to ‖J diag(v)‖²; rounding leaves about 1e-24
// Distance from its bound below which an inequality is active, in the units of the row.
constexpr double kActive = 1e-6;
constexpr int kDirections = 6;     // maximum number of null directions that are computed
constexpr std::size_t kNamed = 3;  // variables that the message names

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

std::string unobservable_directions(NlpEvaluator& nlp, bool inequalities) {
  BlockCholesky cholesky(nlp.hessian_pattern());
  Eigen::VectorXd gradient(nlp.num_unknowns());
  Eigen::VectorXd hessian(nlp.hessian_pattern().nonzeros());
  return unobservable_directions(nlp, {cholesky, gradient, hessian}, inequalities);
}

std::string unobservable_directions(NlpEvaluator& nlp, const Workspace& work, bool inequalities) {
  Eigen::VectorXd& hessian = work.hessian;
  Eigen::VectorXd weights;
  double size = 0.0;
  const ChunkedLoop parts(nlp.tasks(), hessian.size());
  const auto sum_of_sizes = [&] {
    return parts.sum([&](Eigen::Index begin, Eigen::Index size) { return hessian.segment(begin, size).lpNorm<1>(); });
  };
  try {
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
  } catch (const UndefinedResidualError&) {
    return {};
  }
  if (!std::isfinite(size)) return {};
  auto basis = work.cholesky.null_space(hessian, BlockCholesky::kRelativePivot, kDirections);
  // A weak pivot is only an indication. Long chains and loose priors cause it too. The change of the residuals along
  // the direction decides, because it keeps all digits.
  std::erase_if(basis, [&](const Eigen::VectorXd& v) {
    const NlpEvaluator::Stiffness s = nlp.stiffness(v, weights);
    return s.along > kMinStiffness * s.scale;
  });
  if (basis.empty()) return {};

  std::vector<std::string> order;
  std::map<std::string, std::map<int, std::string>> unobservable;  // variable -> tangent entry -> name of the direction
  for (const auto& v : basis) {
    const double largest = v.cwiseAbs().maxCoeff();
    for (Eigen::Index i = 0; i < v.size(); ++i) {
      if (std::abs(v[i]) < 0.3 * largest) continue;
      const auto u = nlp.describe_unknown(static_cast<int>(i));
      if (!unobservable.contains(u.variable)) order.push_back(u.variable);
      unobservable[u.variable][u.entry] = u.direction;
    }
  }
  std::string text;
  for (std::size_t k = 0; k < std::min(order.size(), kNamed); ++k) {
    text += (k ? "; " : "") + order[k] + " in ";
    bool first = true;
    for (const auto& [entry, name] : unobservable[order[k]]) {
      text += (first ? "" : ", ") + name;
      first = false;
    }
  }
  if (order.size() > kNamed)
    text += "; and " + std::to_string(order.size() - kNamed) +
            (order.size() == kNamed + 1 ? " more variable" : " more variables");
  return text;
}

std::string rank_deficiency(const std::string& directions) {
  return "the problem is rank deficient; unobservable: " + directions +
         " (add a residual that observes them, or fix them)";
}

}  // namespace tandem::detail
