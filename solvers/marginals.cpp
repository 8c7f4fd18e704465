#include <algorithm>
#include <cmath>
#include <numeric>

#include <tandem/solvers/marginals.hpp>
#include <tandem/solvers/observability.hpp>

namespace tandem {
namespace {

detail::LinearEquations equalities_of(Program& program) {
  const TripletPattern& pattern = program.jacobian_pattern();
  Eigen::VectorXd values(static_cast<Eigen::Index>(pattern.row.size()));
  program.constraint_jacobian(values);
  detail::LinearEquations equations;
  std::vector<int> equation(std::size_t(program.num_rows()), -1);
  for (int row = 0; row < program.num_rows(); ++row)
    if (program.lower()[row] == program.upper()[row]) equation[std::size_t(row)] = equations.num_rows++;
  for (std::size_t k = 0; k < pattern.row.size(); ++k) {
    const int row = equation[std::size_t(pattern.row[k])];
    if (row < 0) continue;
    equations.row.push_back(row);
    equations.column.push_back(pattern.column[k]);
    equations.value.push_back(values[Eigen::Index(k)]);
    if (!std::isfinite(values[Eigen::Index(k)]))
      throw Error("marginals: " + program.describe_row(pattern.row[k]) + " has a derivative that is not finite");
  }
  return equations;
}

[[noreturn]] void throw_singular(Program& program, int unknown) {
  const auto u = program.describe_unknown(unknown);
  throw Error("marginals: the Hessian is singular to rounding, found at " + u.variable + " in " + u.direction +
              " (add a residual that observes it, or fix it)");
}

/// The Hessian's blocks of pairs of variables, without those of fixed ones.
std::vector<std::pair<int, int>> blocks_of(const Program& program, int id_bound,
                                           std::span<const Marginals::Pair> pairs) {
  std::vector<std::pair<int, int>> blocks;
  for (const auto& [a, b] : pairs) {
    if (std::min(a, b) < 0 || std::max(a, b) >= id_bound)
      throw Error("marginals: a pair names a variable that is not in the problem");
    if (program.block_of(a) >= 0 && program.block_of(b) >= 0)
      blocks.emplace_back(program.block_of(a), program.block_of(b));
  }
  return blocks;
}

}  // namespace

Marginals::Marginals(Problem& problem, std::span<const Pair> pairs, const Stop& stop)
    : parts_(compute(problem, pairs, stop)) {}

Marginals::Parts Marginals::compute(Problem& problem, std::span<const Pair> pairs, const Stop& stop) {
  const auto check = [&stop] { stop.check("marginals"); };
  Program program(problem);
  check();
  Parts parts{std::vector<int>(std::size_t(problem.id_bound())),
              detail::SelectedInverse(program.hessian_pattern(), blocks_of(program, problem.id_bound(), pairs))};
  for (int id = 0; id < problem.id_bound(); ++id) parts.block_of_variable[std::size_t(id)] = program.block_of(id);

  Eigen::VectorXd gradient(program.num_unknowns());
  Eigen::VectorXd hessian(program.hessian_pattern().nonzeros());
  program.linearize(gradient, hessian);
  if (!hessian.allFinite()) {
    const std::string block = program.describe_bad_block();
    throw Error("marginals: " + (block.empty() ? "a residual" : block) + " has derivatives that are not finite");
  }
  const bool positive = parts.inverse.compute(hessian, equalities_of(program), check);
  if (!positive || parts.inverse.weak()) {
    // A weak pivot is a suspicion only: a long chain or a loose prior has them too.
    const std::string free = detail::free_directions(program, false);
    if (!free.empty()) throw Error("marginals: " + free);
    if (!positive) throw_singular(program, parts.inverse.failed_unknown());
  }
  return parts;
}

int Marginals::block_of(int variable_id) const {
  if (std::size_t(variable_id) >= parts_.block_of_variable.size())
    throw Error("marginals: the variable was added to the problem after they were computed, or is not there any more");
  return parts_.block_of_variable[std::size_t(variable_id)];
}

void Marginals::block(int a, int b, Eigen::Ref<Eigen::MatrixXd> S) const {
  const int p = block_of(a), q = block_of(b);
  if (p < 0 || q < 0) {
    S.setZero();
  } else {
    parts_.inverse.block(p, q, S);
  }
}

Eigen::MatrixXd Marginals::joint(std::span<const int> variable_ids, std::span<const int> dofs) const {
  const int n = std::accumulate(dofs.begin(), dofs.end(), 0);
  Eigen::MatrixXd S(n, n);
  for (std::size_t a = 0, row = 0; a < dofs.size(); row += std::size_t(dofs[a++]))
    for (std::size_t b = 0, column = 0; b < dofs.size(); column += std::size_t(dofs[b++]))
      block(variable_ids[a], variable_ids[b], S.block(Eigen::Index(row), Eigen::Index(column), dofs[a], dofs[b]));
  return S;
}

bool Marginals::in_pattern(int a, int b) const {
  const int p = block_of(a), q = block_of(b);
  return p < 0 || q < 0 || parts_.inverse.holds(p, q);
}

}  // namespace tandem
