#include <algorithm>
#include <cmath>
#include <numeric>

#include <tandem/solvers/marginals.hpp>
#include <tandem/solvers/observability.hpp>

namespace tandem {
namespace {

detail::LinearEquations equalities_of(NlpEvaluator& nlp) {
  const TripletPattern& pattern = nlp.jacobian_pattern();
  Eigen::VectorXd values(static_cast<Eigen::Index>(pattern.row.size()));
  nlp.constraint_jacobian(values);
  detail::LinearEquations equations;
  std::vector<int> equation(std::size_t(nlp.num_rows()), -1);
  for (int row = 0; row < nlp.num_rows(); ++row)
    if (nlp.lower()[row] == nlp.upper()[row]) equation[std::size_t(row)] = equations.num_rows++;
  for (std::size_t k = 0; k < pattern.row.size(); ++k) {
    const int row = equation[std::size_t(pattern.row[k])];
    if (row < 0) continue;
    equations.row.push_back(row);
    equations.column.push_back(pattern.column[k]);
    equations.value.push_back(values[Eigen::Index(k)]);
    if (!std::isfinite(values[Eigen::Index(k)]))
      throw UndefinedResidualError("marginals: " + nlp.describe_row(pattern.row[k]) +
                                   " has a derivative that is not finite");
  }
  return equations;
}

[[noreturn]] void throw_singular(NlpEvaluator& nlp, int unknown) {
  const auto u = nlp.describe_unknown(unknown);
  const std::string state = u.variable + " in " + u.direction;
  throw NotObservableError(
      "marginals: the Hessian is numerically singular at " + state + " (add a residual that observes it, or fix it)",
      state);
}

/// Returns pairs of Hessian blocks for pairs of variables, without those of fixed variables.
std::vector<std::pair<int, int>> blocks_of(const NlpEvaluator& nlp, int id_bound,
                                           std::span<const Marginals::Pair> pairs) {
  std::vector<std::pair<int, int>> blocks;
  for (const auto& [a, b] : pairs) {
    if (std::min(a, b) < 0 || std::max(a, b) >= id_bound)
      throw StaleHandleError("marginals: a pair names a variable that is not in the problem");
    if (nlp.block_of(a) >= 0 && nlp.block_of(b) >= 0) blocks.emplace_back(nlp.block_of(a), nlp.block_of(b));
  }
  return blocks;
}

}  // namespace

Marginals::Marginals(Problem& problem, std::span<const Pair> pairs, const Stop& stop)
    : parts_(compute(problem, pairs, stop)) {}

Marginals::Parts Marginals::compute(Problem& problem, std::span<const Pair> pairs, const Stop& stop) {
  const auto check = [&stop] { stop.check("marginals"); };
  NlpEvaluator nlp(problem);
  check();
  Parts parts{std::vector<int>(std::size_t(problem.id_bound())),
              {},
              detail::SelectedInverse(nlp.hessian_pattern(), blocks_of(nlp, problem.id_bound(), pairs))};
  for (int id = 0; id < problem.id_bound(); ++id) {
    parts.block_of_variable[std::size_t(id)] = nlp.block_of(id);
    parts.variables.push_back(problem.handle(id));
  }

  Eigen::VectorXd gradient(nlp.num_unknowns());
  Eigen::VectorXd hessian(nlp.hessian_pattern().nonzeros());
  nlp.linearize(gradient, hessian);
  if (!hessian.allFinite()) {
    const std::string block = nlp.describe_nonfinite_block();
    throw UndefinedResidualError("marginals: " + (block.empty() ? "a residual" : block) +
                                 " has derivatives that are not finite");
  }
  const bool positive = parts.inverse.compute(hessian, equalities_of(nlp), check);
  if (!positive || parts.inverse.weak()) {
    // A weak pivot is only an indication. Long chains and loose priors cause it too.
    const std::string unobservable = detail::unobservable_directions(nlp, false);
    if (!unobservable.empty())
      throw NotObservableError("marginals: " + detail::rank_deficiency(unobservable), unobservable);
    if (!positive) throw_singular(nlp, parts.inverse.failed_unknown());
  }
  return parts;
}

int Marginals::id(const VariableHandle& x) const {
  const bool known = std::size_t(x.slot) < parts_.variables.size();
  const VariableHandle& own = known ? parts_.variables[std::size_t(x.slot)] : VariableHandle();
  if (!x.name || own.problem != x.problem || own.generation != x.generation)
    throw StaleHandleError("marginals: variable " + (x.name ? *x.name : "(none)") +
                           " was not in the problem when the marginals were computed");
  return x.slot;
}

int Marginals::block_of(int variable_id) const {
  if (std::size_t(variable_id) >= parts_.block_of_variable.size() || !parts_.variables[std::size_t(variable_id)].name)
    throw StaleHandleError("marginals: no variable had ID " + std::to_string(variable_id) +
                           " when the marginals were computed");
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
  return p < 0 || q < 0 || parts_.inverse.in_pattern(p, q);
}

}  // namespace tandem
