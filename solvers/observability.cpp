#include <cmath>
#include <map>
#include <vector>

#include <tandem/solvers/observability.hpp>

namespace tandem::detail {
namespace {

/// Pivots this small against their diagonal may be rounding.
constexpr double kRelativePivot = 1e-12;
constexpr double kFree = 1e-20;   // ‖J v‖² against ‖J diag(v)‖²: rounding leaves some 1e-24
constexpr double kActive = 1e-6;  // how close to its bound an inequality is one that holds, in the row's units
constexpr int kDirections = 6;    // enough to tell what is free
constexpr std::size_t kNamed = 3;

/// Weights of the rows. Hard ones: those that hold the point, as stiff as the soft residuals are on average. An inequality
/// that is not at its bound tells nothing.
Eigen::VectorXd active_rows(Program& program, double stiffness, bool inequalities) {
  Eigen::VectorXd c(program.num_rows());
  program.constraints(c);
  for (Eigen::Index i = 0; i < c.size(); ++i) {
    if (const double w = program.soft_weights()[i]; w > 0) {  // a soft bound: what it adds to the cost
      c[i] = c[i] < program.lower()[i] || c[i] > program.upper()[i] ? w : 0.0;
      continue;
    }
    const double away = std::min(c[i] - program.lower()[i], program.upper()[i] - c[i]);
    c[i] = away <= kActive && (inequalities || program.lower()[i] == program.upper()[i]) ? stiffness : 0.0;
  }
  return c;
}

}  // namespace

std::string free_directions(Program& program, bool inequalities) {
  BlockCholesky cholesky(program.hessian_pattern());
  Eigen::VectorXd gradient(program.num_unknowns());
  Eigen::VectorXd hessian(program.hessian_pattern().nonzeros());
  return free_directions(program, {cholesky, gradient, hessian}, inequalities);
}

std::string free_directions(Program& program, const Workspace& work, bool inequalities) {
  Eigen::VectorXd& hessian = work.hessian;
  Eigen::VectorXd weights;
  double size = 0.0;
  const LaneParts parts(program.lanes(), hessian.size());
  const auto sum_of_sizes = [&] {
    return parts.sum([&](Eigen::Index begin, Eigen::Index size) { return hessian.segment(begin, size).lpNorm<1>(); });
  };
  try {
    if (!work.has_hessian) program.linearize(work.gradient, hessian);
    size = sum_of_sizes();
    if (program.num_rows() > 0) {
      const double mean = size / double(program.num_unknowns());
      weights = active_rows(program, mean > 0 ? mean : 1.0, inequalities);
      Eigen::VectorXd jacobian(static_cast<Eigen::Index>(program.jacobian_pattern().row.size()));
      program.constraint_jacobian(jacobian);
      program.add_constraint_hessian(weights, jacobian, hessian);
      size = sum_of_sizes();
    }
  } catch (const Error&) {
    return {};
  }
  if (!std::isfinite(size)) return {};
  auto basis = work.cholesky.null_space(hessian, kRelativePivot, kDirections);
  // A weak pivot is a suspicion: a long chain or a loose prior has them too. The residuals' own answer to a step along
  // the direction decides, which keeps all its digits.
  std::erase_if(basis, [&](const Eigen::VectorXd& v) {
    const Program::Stiffness s = program.stiffness(v, weights);
    return s.along > kFree * s.scale;
  });
  if (basis.empty()) return {};

  std::vector<std::string> order;
  std::map<std::string, std::map<int, std::string>> free;  // variable -> entry -> direction
  for (const auto& v : basis) {
    const double largest = v.cwiseAbs().maxCoeff();
    for (Eigen::Index i = 0; i < v.size(); ++i) {
      if (std::abs(v[i]) < 0.3 * largest) continue;
      const auto u = program.describe_unknown(static_cast<int>(i));
      if (!free.contains(u.variable)) order.push_back(u.variable);
      free[u.variable][u.entry] = u.direction;
    }
  }
  std::string text = "the problem leaves free: ";
  for (std::size_t k = 0; k < std::min(order.size(), kNamed); ++k) {
    text += (k ? "; " : "") + order[k] + " in ";
    bool first = true;
    for (const auto& [entry, name] : free[order[k]]) {
      text += (first ? "" : ", ") + name;
      first = false;
    }
  }
  if (order.size() > kNamed)
    text += "; and " + std::to_string(order.size() - kNamed) +
            (order.size() == kNamed + 1 ? " more variable" : " more variables");
  return text + " (add a residual that observes them, or fix them)";
}

}  // namespace tandem::detail
