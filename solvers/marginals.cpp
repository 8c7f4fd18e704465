#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <tandem/solvers/gauge_search.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>
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
    : parts_(compute(problem, pairs, stop, detail::Gauges::search)) {}

Marginals Marginals::without_gauges(Problem& problem, const Stop& stop) {
  return Marginals(compute(problem, {}, stop, detail::Gauges::ignore));
}

Marginals::Parts Marginals::compute(Problem& problem, std::span<const Pair> pairs, const Stop& stop,
                                    detail::Gauges gauges) {
  const auto check = [&stop] { stop.check("marginals"); };
  NlpEvaluator nlp(problem);
  check();
  Parts parts{std::vector<int>(std::size_t(problem.id_bound())),
              {},
              nlp.hessian_pattern().first,
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
  parts.log_determinant = parts.inverse.log_determinant();
  // With constraints, the pivots of `inverse` are not those from which null directions are found.
  const bool any_small = gauges == detail::Gauges::search || nlp.num_rows() > 0;
  const double least = any_small ? detail::kSuspiciousPivot : BlockCholesky::kRelativePivot;
  if (!positive || parts.inverse.smallest_pivot() < least) regularize(nlp, hessian, stop, gauges, parts);
  return parts;
}

/// Computes the covariances of a problem with flat directions. Unknowns that are pinned make H regular. Covariances of
/// functions that are constant along the flat directions do not depend on the pins. The other covariances follow from
/// the curvature F = (NᵀHN)^(−1/2) of the directions N, computed from residuals without loss of digits.
void Marginals::regularize(NlpEvaluator& nlp, const Eigen::VectorXd& hessian, const Stop& stop, detail::Gauges gauges,
                           Parts& parts) {
  constexpr int kMostDirections = 60;
  const int singular_at = parts.inverse.failed_unknown();
  const std::vector<detail::FlatDirection> flat =
      detail::flat_directions(nlp, false, kMostDirections, stop, nullptr, gauges);
  if (flat.empty() && singular_at >= 0) throw_singular(nlp, singular_at);
  if (flat.empty()) return;
  const SymmetricPattern& pattern = nlp.hessian_pattern();
  Eigen::VectorXd curvature(nlp.num_unknowns()), pinned = hessian;
  detail::hessian_diagonal(pattern, hessian, curvature);
  double log_pins = 0;
  std::vector<const Eigen::VectorXd*> weak, null;
  std::vector<int> pins;  // pinned unknowns of the weak directions
  for (const detail::FlatDirection& direction : flat) {
    if (direction.unknown < 0) continue;
    (direction.unobservable ? null : weak).push_back(&direction.v);
    if (!direction.unobservable) pins.push_back(direction.unknown);
    const auto block = std::upper_bound(pattern.first.begin(), pattern.first.end(), direction.unknown) - 1;
    const double pin = curvature[direction.unknown] > 0 ? curvature[direction.unknown] : 1.0;
    pinned[pattern.diagonal(int(block - pattern.first.begin()), direction.unknown - *block)] += pin;
    if (!direction.unobservable) log_pins += std::log(pin);
  }
  if (null.size() + weak.size() > 0 &&
      !parts.inverse.compute(pinned, equalities_of(nlp), [&stop] { stop.check("marginals"); }))
    throw_singular(nlp, parts.inverse.failed_unknown());
  if (!weak.empty()) {
    // The columns of the pinned inverse at the pins span H⁻¹ at the pins, which are the flat directions.
    std::vector<Eigen::VectorXd> refined;
    BlockCholesky cholesky(pattern);
    if (nlp.num_rows() == 0 && cholesky.factorize(pinned))
      for (const int unknown : pins) {
        Eigen::VectorXd v = Eigen::VectorXd::Unit(nlp.num_unknowns(), unknown);
        cholesky.solve(v);
        refined.push_back(v.normalized());
      }
    for (std::size_t i = 0; i < refined.size(); ++i) weak[i] = &refined[i];
    const Eigen::Index k = Eigen::Index(weak.size());
    const auto curvature_along = [&](const Eigen::VectorXd& v) {
      return nlp.stiffness(v, Eigen::VectorXd::Zero(nlp.num_rows())).along;
    };
    Eigen::MatrixXd N(nlp.num_unknowns(), k), Q(k, k);
    for (Eigen::Index i = 0; i < k; ++i) {
      N.col(i) = *weak[std::size_t(i)];
      Q(i, i) = curvature_along(N.col(i));
      N.col(i) /= std::sqrt(Q(i, i));  // units in which Q is near 1
    }
    for (Eigen::Index i = 0; i < k; ++i)
      for (Eigen::Index j = 0; j < i; ++j)
        Q(i, j) = Q(j, i) = 0.25 * (curvature_along(N.col(i) + N.col(j)) - curvature_along(N.col(i) - N.col(j)));
    Q.diagonal().setOnes();
    const Eigen::LLT<Eigen::MatrixXd> llt(Q);
    if (llt.info() != Eigen::Success) throw_singular(nlp, singular_at >= 0 ? singular_at : flat.front().unknown);
    parts.flat = llt.matrixL().solve(N.transpose()).transpose();
    const Eigen::PartialPivLU<Eigen::MatrixXd> at_pins(N(pins, Eigen::seqN(0, k)));
    parts.log_determinant = parts.inverse.log_determinant() - log_pins +
                            2 * llt.matrixLLT().diagonal().array().log().sum() -
                            2 * at_pins.matrixLU().diagonal().array().abs().log().sum();
  }
  parts.null.resize(nlp.num_unknowns(), Eigen::Index(null.size()));
  for (std::size_t i = 0; i < null.size(); ++i) parts.null.col(Eigen::Index(i)) = *null[i];
  if (!null.empty()) parts.log_determinant = -HUGE_VAL;
  parts.unobservable = detail::unobservable_states(nlp, flat);
  if (parts.unobservable.empty()) return;
  parts.infinite = detail::unobservable_unknowns(flat, curvature);
  if (null.empty()) return;
  for (Eigen::Index i = 0; i < parts.null.rows(); ++i)  // the other entries are rounding errors
    if (!parts.infinite[std::size_t(i)]) parts.null.row(i).setZero();
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

bool Marginals::finite_block(int a, int b, Eigen::Ref<Eigen::MatrixXd> S) const {
  const int p = block_of(a), q = block_of(b);
  if (p < 0 || q < 0) {
    S.setZero();
    return false;
  }
  parts_.inverse.block(p, q, S);
  const int row = parts_.first_unknown[std::size_t(p)], column = parts_.first_unknown[std::size_t(q)];
  if (parts_.flat.size() > 0)
    S += parts_.flat.middleRows(row, S.rows()) * parts_.flat.middleRows(column, S.cols()).transpose();
  return true;
}

void Marginals::block(int a, int b, Eigen::Ref<Eigen::MatrixXd> S) const {
  if (!finite_block(a, b, S) || parts_.infinite.empty()) return;
  const int row = parts_.first_unknown[std::size_t(block_of(a))];
  const int column = parts_.first_unknown[std::size_t(block_of(b))];
  for (int i = 0; i < S.rows(); ++i)
    for (int j = 0; j < S.cols(); ++j)
      if (parts_.infinite[std::size_t(row + i)] || parts_.infinite[std::size_t(column + j)])
        S(i, j) = row + i == column + j ? HUGE_VAL : 0.0;
}

Eigen::MatrixXd Marginals::propagated(const Eigen::Ref<const Eigen::MatrixXd>& J, std::span<const int> variable_ids,
                                      std::span<const int> dofs) const {
  // Largest change along a null direction by rounding, relative to that without cancellation.
  constexpr double kUnchanged = 1e-8;
  Eigen::MatrixXd S(J.cols(), J.cols()), N = Eigen::MatrixXd::Zero(J.cols(), parts_.null.cols());
  for (std::size_t a = 0, row = 0; a < dofs.size(); row += std::size_t(dofs[a++])) {
    for (std::size_t b = 0, column = 0; b < dofs.size(); column += std::size_t(dofs[b++]))
      finite_block(variable_ids[a], variable_ids[b],
                   S.block(Eigen::Index(row), Eigen::Index(column), dofs[a], dofs[b]));
    if (const int p = block_of(variable_ids[a]); p >= 0 && N.cols() > 0)
      N.middleRows(Eigen::Index(row), dofs[a]) = parts_.null.middleRows(parts_.first_unknown[std::size_t(p)], dofs[a]);
  }
  Eigen::MatrixXd result = J * S * J.transpose();
  const Eigen::MatrixXd change = (J * N).cwiseAbs(), scale = J.cwiseAbs() * N.cwiseAbs();
  for (Eigen::Index i = 0; i < J.rows(); ++i) {
    if (((change - kUnchanged * scale).row(i).array() <= 0).all()) continue;
    result.row(i).setZero();
    result.col(i).setZero();
    result(i, i) = HUGE_VAL;
  }
  return result;
}

Eigen::VectorXd Marginals::times(const Eigen::VectorXd& x) const {
  Eigen::VectorXd product = parts_.inverse.times(x);
  if (parts_.flat.size() > 0) product += parts_.flat * (parts_.flat.transpose() * x);
  return product;
}

void Marginals::require_regular() const {
  if (std::isfinite(parts_.log_determinant)) return;
  const std::string states = describe(parts_.unobservable);
  throw NotObservableError("marginals: the problem is rank deficient; unobservable: " + states, states);
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
