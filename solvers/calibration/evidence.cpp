#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include <tandem/solvers/calibration/block_unknowns.hpp>
#include <tandem/solvers/calibration/counted_rows.hpp>
#include <tandem/solvers/calibration/evidence.hpp>
#include <tandem/solvers/calibration/log_constants.hpp>
#include <tandem/solvers/calibration/log_factors.hpp>

namespace tandem::detail {
namespace {

constexpr int kHalvings = 3;  // halvings of a change of noise that Gauss-Newton steps cannot follow

}  // namespace

Evidence::Evidence(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups,
                   const CalibrationOptions& options)
    : options_(options), groups_(groups), rows_(Eigen::VectorXd::Zero(Eigen::Index(groups.size()))), counted_(rows_) {
  if (problems.empty()) throw BadInputError("calibrate: no problem is given");
  for (const Eigen::VectorXd* of_groups : {&options.initial_log_factors, &options.counted_rows})
    if (of_groups->size() > 0 && of_groups->size() != Eigen::Index(groups.size()))
      throw BadInputError("calibrate: initial_log_factors and counted_rows need one entry per noise group");
  if (options.initial_log_factors.size() > 0 && options.counted_rows.size() == 0)
    throw BadInputError("calibrate: initial_log_factors requires counted_rows");
  if (!(options.max_factor > 1)) throw BadInputError("calibrate: max_factor must be greater than 1");
  if (!(options.tolerance > 0)) throw BadInputError("calibrate: tolerance must be positive");
  problems_ = detail::copies_of(problems);
  std::map<std::tuple<int, int, int>, std::size_t> known;  // index in members_
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const NoiseGroup& group = groups[g];
    if (group.rows.empty()) throw BadInputError("calibrate: the noise group " + group.name + " has no rows");
    if (!(group.prior >= 0))
      throw BadInputError("calibrate: the prior of noise group " + group.name +
                          " is negative; it is a standard deviation, 0 for none");
    for (const NoiseRows& rows : group.rows) {
      const Problem& problem = detail::problem_at(problems, rows.problem);
      const auto [at, is_new] = known.try_emplace({rows.problem, rows.block.pool, rows.block.id}, members_.size());
      if (is_new) {
        const Gaussian given = problem.noise(rows.block);
        const int n = static_cast<int>(given.dim());
        members_.push_back({problems_[std::size_t(rows.problem)]->counterpart(rows.block), rows.problem, given,
                            std::vector<int>(std::size_t(n), -1), std::vector<double>(std::size_t(n), 0.0)});
      }
      std::vector<int>& of_row = members_[at->second].group;
      const int n = static_cast<int>(of_row.size()), end = rows.count < 0 ? n : rows.first + rows.count;
      if (!(rows.share > 0 && rows.share <= 1))
        throw BadInputError("calibrate: noise group " + group.name + " has rows with a share outside (0, 1]");
      if (rows.first < 0 || rows.first >= end || end > n)
        throw BadInputError("calibrate: noise group " + group.name + " refers to rows that its block does not have");
      for (int i = rows.first; i < end; ++i) {
        if (of_row[std::size_t(i)] >= 0)
          throw BadInputError("calibrate: a row is in two noise groups, " +
                              groups[std::size_t(of_row[std::size_t(i)])].name + " and " + group.name);
        of_row[std::size_t(i)] = static_cast<int>(g);
        rows_[Eigen::Index(g)] += rows.share;
        members_[at->second].share[std::size_t(i)] = rows.share;
      }
    }
  }
  counted_ = Eigen::VectorXd::Zero(rows_.size());
  prior_only_ = Eigen::VectorXd::Ones(rows_.size());
  measured_.resize(problems.size());
  std::set<std::tuple<int, int, int>> is_measured;
  for (const MeasuredBlock& m : options.measured) {
    const Problem& problem = detail::problem_at(problems, m.problem);
    measured_[std::size_t(m.problem)].push_back(problems_[std::size_t(m.problem)]->counterpart(m.block));
    is_measured.emplace(m.problem, m.block.pool, m.block.id);
    // Throws if it is not a density.
    log_constant(problem.loss(m.block), static_cast<int>(problem.noise(m.block).dim()));
  }
  for (Member& m : members_) {
    m.measured = is_measured.empty() || is_measured.contains({m.problem, m.block.pool, m.block.id});
    for (std::size_t i = 0; m.measured && i < m.group.size(); ++i) {
      if (m.group[i] < 0) continue;
      counted_[m.group[i]] += m.share[i];
      prior_only_[m.group[i]] = 0;
    }
  }
  if (options.counted_rows.size() > 0) counted_ = options.counted_rows;
  solved_at_.assign(problems.size(), Eigen::VectorXd::Zero(rows_.size()));
}

void Evidence::create_approximations() {
  for (std::size_t p = laplace_.size(); p < problems_.size(); ++p) {
    options_.stop.check("calibrate");
    laplace_.push_back(std::make_unique<LaplaceApproximation>(*problems_[p], options_, measured_[p]));
  }
}

bool Evidence::count_rows() {
  constexpr int kGrid = 64;
  std::map<std::tuple<Loss::Kind, double, Eigen::Index>, std::vector<double>> tables;  // counted_rows() by leverage
  Eigen::VectorXd counted = Eigen::VectorXd::Zero(counted_.size());
  for (std::size_t p = 0; p < problems_.size(); ++p) {
    const Problem& problem = *problems_[p];
    const LaplaceApproximation& laplace = *laplace_[p];
    for (const Member& m : members_) {
      if (std::size_t(m.problem) != p || !m.measured) continue;
      const Loss loss = problem.loss(m.block);
      const auto n = Eigen::Index(m.group.size());
      double each = 1;
      if (loss.kind != Loss::Kind::none) {
        std::vector<double>& table = tables[{loss.kind, loss.scale, n}];
        for (int i = static_cast<int>(table.size()); i <= kGrid; ++i)
          table.push_back(counted_rows(loss, static_cast<int>(n), double(i) / kGrid) / double(n));
        const Problem::Linearization at = problem.linearization(m.block);
        const Eigen::MatrixXd J = problem.noise(m.block).sqrt_information() * at.jacobian;
        const double leverage = problem.weight(m.block) *
                                (J * laplace.covariances().joint(at.variable_ids, at.dofs) * J.transpose()).trace();
        const double place = std::clamp(leverage / double(n), 0.0, 1.0) * kGrid;
        const auto below = std::min(std::size_t(place), std::size_t(kGrid - 1));
        each = table[below] + (place - double(below)) * (table[below + 1] - table[below]);
      }
      for (std::size_t i = 0; i < m.group.size(); ++i)
        if (m.group[i] >= 0) counted[m.group[i]] += m.share[i] * each;
    }
  }
  const bool changed = ((counted - counted_).array().abs() > 0.01 * counted.array()).any();
  counted_ = counted;
  return changed;
}

void Evidence::set_noise(std::size_t problem, const Eigen::VectorXd& log_factors) {
  for (const Member& m : members_) {
    if (std::size_t(m.problem) != problem) continue;
    Eigen::VectorXd factor(m.given.dim());
    for (Eigen::Index i = 0; i < factor.size(); ++i) {
      const int g = m.group[std::size_t(i)];
      factor[i] = g < 0 ? 1.0 : std::exp(log_factors[g]);
    }
    problems_[problem]->set_noise(m.block, m.given.scaled(factor));
  }
}

/// Follows the solution from the noise `from` to `to` by Gauss-Newton steps. If they fail, halves the change of the
/// noise.
bool Evidence::update_by_steps(std::size_t p, const Eigen::VectorXd& from, const Eigen::VectorXd& to, int halvings) {
  set_noise(p, to);
  ++solves_;
  if (laplace_[p]->update_by_steps()) return true;
  if (halvings == 0) return false;
  const Eigen::VectorXd between = 0.5 * (from + to);
  return update_by_steps(p, from, between, halvings - 1) && update_by_steps(p, between, to, halvings - 1);
}

/// Solves problem p with new noise and computes its covariances. On failure, restores the last solution.
bool Evidence::update(std::size_t p, const Eigen::VectorXd& log_factors) {
  LaplaceApproximation& laplace = *laplace_[p];
  const auto solve = [&] {
    if (!update_by_steps(p, solved_at_[p], log_factors, kHalvings)) {
      set_noise(p, log_factors);
      ++solves_;
      if (!laplace.update()) return false;
    }
    return laplace.find_covariances();
  };
  if (!solve()) {
    laplace.restore_values();
    return false;
  }
  laplace.save_values();
  solved_at_[p] = log_factors;
  return true;
}

/// Adds the rows of a block to the gradient and the effective rows. With W = W₀ D⁻¹ and D the diagonal of factors,
/// ∂(W r)/∂log D_i = −w_i r_i, where w_i is column i of W.
void Evidence::add(const Member& member, const LaplaceApproximation& laplace, const LossTerms& losses,
                   Value& value) const {
  const Problem& problem = *problems_[std::size_t(member.problem)];
  const Problem::Linearization at = problem.linearization(member.block);
  const Eigen::MatrixXd W = problem.noise(member.block).sqrt_information();
  const Loss loss = problem.loss(member.block);
  const Eigen::MatrixXd& J = at.jacobian;
  Eigen::MatrixXd S = laplace.covariances().joint(at.variable_ids, at.dofs);
  const Eigen::MatrixXd information = W.transpose() * W;
  Eigen::VectorXd squares = (information * at.residual).cwiseProduct(at.residual);
  const auto [rho, weight, change] = loss(squares.sum());
  Eigen::VectorXd other = Eigen::VectorXd::Zero(squares.size());
  if (losses.any()) {
    S -= 2 * losses.hessian_derivative(at.variable_ids, at.dofs);
    other = losses.noise_derivative(laplace, member.block, at);
  }
  Eigen::MatrixXd V = J * S * J.transpose();
  if (laplace.has_prior_term() && !member.measured)
    V -= laplace.prior_covariances().propagated(J, at.variable_ids, at.dofs);
  Eigen::VectorXd shares = weight * (information * V).diagonal();
  if (change != 0) shares += change / weight * shares.sum() * squares;  // of the weight with the noise
  if (losses.of(member.block)) shares *= expected_curvature(loss);
  if (!member.measured && laplace.prior_step().size() > 0) {
    const Eigen::VectorXd prior_residual =
        at.residual + J * block_part(laplace.nlp(), at.variable_ids, at.dofs, J.cols(), laplace.prior_step());
    squares -= (information * prior_residual).cwiseProduct(prior_residual);
  }
  for (Eigen::Index i = 0; i < at.residual.size(); ++i) {
    const int g = member.group[std::size_t(i)];
    if (g < 0) continue;
    value.gradient[g] += weight * squares[i] + shares[i] + other[i];
    value.effective_rows[g] -= shares[i];
  }
}

void Evidence::add_information(const Member& member, Eigen::MatrixXd& gradients, Eigen::MatrixXd& squares) const {
  const Problem& problem = *problems_[std::size_t(member.problem)];
  const Problem::Linearization at = problem.linearization(member.block);
  const Eigen::MatrixXd W = problem.noise(member.block).sqrt_information();
  const double weight = problem.weight(member.block);
  const auto& nlp = laplace_[std::size_t(member.problem)]->nlp();
  // The sum of the columns of group g is r̃_g.
  const Eigen::MatrixXd WJ = W * at.jacobian, rows = W * at.residual.asDiagonal();
  const Eigen::MatrixXd row_gradients = weight * WJ.transpose() * rows, row_squares = weight * rows.transpose() * rows;
  for (Eigen::Index i = 0; i < at.residual.size(); ++i) {
    const int g = member.group[std::size_t(i)];
    if (g < 0) continue;
    add_block_part(nlp, at.variable_ids, at.dofs, row_gradients.col(i), gradients.col(g));
    if (!member.measured) continue;
    for (Eigen::Index j = 0; j < at.residual.size(); ++j)
      if (const int h = member.group[std::size_t(j)]; h >= 0) squares(g, h) += row_squares(i, j);
  }
}

/// Let the measurements be y = J x + noise of covariance R, and the prior x ~ N(x₀, H_b⁻¹). With V = R + J H_b⁻¹ Jᵀ,
/// P y = V⁻¹ (y − J x₀) and V_g = ∂V/∂log θ_g, the average information is ½ (P y)ᵀ V_g P V_h P y. For a group of
/// measurements, V_g P y = −2 R^½ r̃_g; for a group of priors, V_g P y = 2 J H_b⁻¹ J̃ᵀ r̃_g. Hence the information is
/// 2 (S − Cᵀ H⁻¹ C) with columns c_g = J̃ᵀ r̃_g of C. S is r̃_gᵀ r̃_h for measurements and c_gᵀ H_b⁻¹ c_h for priors.
std::optional<Eigen::MatrixXd> Evidence::information() {
  for (const auto& laplace : laplace_)
    if (!laplace->by_steps()) return {};
  std::vector<Eigen::MatrixXd> gradients;  // C of each problem
  for (const auto& laplace : laplace_)
    gradients.push_back(Eigen::MatrixXd::Zero(laplace->nlp().num_unknowns(), rows_.size()));
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(rows_.size(), rows_.size());
  for (const Member& m : members_) add_information(m, gradients[std::size_t(m.problem)], sum);
  for (std::size_t p = 0; p < problems_.size(); ++p) {
    const LaplaceApproximation& laplace = *laplace_[p];
    const auto add = [&](double factor, const LaplaceApproximation::Covariances& covariances,
                         const Eigen::VectorXd& columns) {
      const Eigen::MatrixXd C = gradients[p] * columns.asDiagonal();
      for (Eigen::Index g = 0; g < C.cols(); ++g)
        if (columns[g] != 0) sum.col(g) += factor * C.transpose() * covariances.times(C.col(g));
    };
    add(-1, laplace.covariances(), Eigen::VectorXd::Ones(rows_.size()));
    if (laplace.has_prior_term()) add(1, laplace.prior_covariances(), prior_only_);
  }
  return Eigen::MatrixXd(sum + sum.transpose());
}

/// Adds all members, in parallel. The partial sums are added in a fixed order, so the result is reproducible.
void Evidence::add_members(Value& value) const {
  std::array<Value, kMaxTasks> parts;
  task_runner_.run(kMaxTasks, [&](int task) {
    Value& part = parts[std::size_t(task)];
    part.gradient = part.effective_rows = Eigen::VectorXd::Zero(rows_.size());
    const std::size_t begin = members_.size() * std::size_t(task) / kMaxTasks;
    const std::size_t end = members_.size() * std::size_t(task + 1) / kMaxTasks;
    for (std::size_t i = begin; i < end; ++i) {
      const auto p = std::size_t(members_[i].problem);
      add(members_[i], *laplace_[p], losses_[p], part);
    }
  });
  for (const Value& part : parts) {
    value.gradient += part.gradient;
    value.effective_rows += part.effective_rows;
  }
}

Evidence::Value Evidence::at(const Eigen::VectorXd& log_factors) {
  create_approximations();
  losses_.resize(problems_.size());
  Value value;
  value.gradient = -counted_;
  value.effective_rows = counted_;
  for (std::size_t p = 0; p < problems_.size(); ++p) {
    LaplaceApproximation& laplace = *laplace_[p];
    if (!update(p, log_factors)) {
      value.why = laplace.why();
      value.unobservable = laplace.unobservable();
      return value;
    }
    value.log_evidence -= laplace.cost() + 0.5 * laplace.covariances().log_determinant();
    if (!losses_[p].find(laplace)) {
      value.why = "the Hessian is numerically singular";
      return value;
    }
    value.log_evidence += losses_[p].value();
    if (laplace.has_prior_term())
      value.log_evidence += 0.5 * laplace.prior_covariances().log_determinant() + laplace.prior_cost();
  }
  add_members(value);
  for (Eigen::Index g = 0; g < rows_.size(); ++g) {
    value.log_evidence -= counted_[g] * log_factors[g];
    const LogPrior prior{groups_[std::size_t(g)].prior};
    value.log_evidence += prior.value(log_factors[g]);
    value.gradient[g] += prior.slope(log_factors[g]);
  }
  value.usable = std::isfinite(value.log_evidence) && value.gradient.allFinite();
  return value;
}

}  // namespace tandem::detail
