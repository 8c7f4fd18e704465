#include <cmath>
#include <map>
#include <vector>

#include <tandem/solvers/block_cholesky.hpp>
#include <tandem/solvers/observability.hpp>

namespace tandem::detail {
namespace {

/// Pivots this small against their diagonal are rounding, not information: those of a long chain held at one end stay
/// above 1e-10.
constexpr double kRelativePivot = 1e-12;
constexpr int kDirections = 6;  // enough to tell what is free
constexpr std::size_t kNamed = 3;

}  // namespace

std::string free_directions(Program& program) {
  Eigen::VectorXd gradient(program.num_unknowns());
  Eigen::VectorXd hessian(static_cast<Eigen::Index>(program.hessian_pattern().row.size()));
  try {
    program.linearize(gradient, hessian);
    program.add_constraint_hessian(1.0, hessian);  // a hard row informs like a soft one of unit sigma
  } catch (const Error&) {
    return {};
  }
  BlockCholesky cholesky(program.hessian_pattern());
  const auto basis = cholesky.null_space(hessian, kRelativePivot, kDirections);
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
