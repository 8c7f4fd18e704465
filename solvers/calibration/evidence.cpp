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

namespace tandem::detail {
namespace {

constexpr int kHalvings = 3;  // of the way to factors that steps do not lead to at once

}  // namespace

Evidence::Evidence(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups,
                   const CalibrationOptions& options)
    : problems_(problems),
      options_(options),
      groups_(groups),
      rows_(Eigen::VectorXd::Zero(Eigen::Index(groups.size()))),
      counted_(rows_) {
  if (problems.empty()) throw Error("calibrate: there is no problem");
  std::map<std::tuple<int, int, int>, std::size_t> known;  // members by problem and block
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const NoiseGroup& group = groups[g];
    if (group.rows.empty()) throw Error("calibrate: the noise group " + group.name + " has no rows");
    if (!(group.prior >= 0)) throw Error("calibrate: the prior of " + group.name + " is negative");
    for (const NoiseRows& rows : group.rows) {
      if (rows.problem < 0 || std::size_t(rows.problem) >= problems.size())
        throw Error("calibrate: " + group.name + " has rows of a problem that is not there");
      const auto [at, is_new] = known.try_emplace({rows.problem, rows.block.pool, rows.block.id}, members_.size());
      if (is_new) {
        const Problem& problem = *problems[std::size_t(rows.problem)];
        const Gaussian given = problem.noise(rows.block);
        const int n = static_cast<int>(given.dim());
        members_.push_back({rows.block, rows.problem, given, std::vector<int>(std::size_t(n), -1),
                            std::vector<double>(std::size_t(n), 0.0)});
      }
      std::vector<int>& of_row = members_[at->second].group;
      const int n = static_cast<int>(of_row.size()), end = rows.count < 0 ? n : rows.first + rows.count;
      if (!(rows.share > 0 && rows.share <= 1))
        throw Error("calibrate: " + group.name + " has rows of no share in (0, 1]");
      if (rows.first < 0 || rows.first >= end || end > n)
        throw Error("calibrate: " + group.name + " has rows that its block has not");
      for (int i = rows.first; i < end; ++i) {
        if (of_row[std::size_t(i)] >= 0)
          throw Error("calibrate: a row is in two noise groups, " + groups[std::size_t(of_row[std::size_t(i)])].name +
                      " and " + group.name);
        of_row[std::size_t(i)] = static_cast<int>(g);
        rows_[Eigen::Index(g)] += rows.share;
        members_[at->second].share[std::size_t(i)] = rows.share;
      }
    }
  }
  counted_ = Eigen::VectorXd::Zero(rows_.size());
  of_beliefs_ = Eigen::VectorXd::Ones(rows_.size());
  measured_.resize(problems.size());
  std::set<std::tuple<int, int, int>> is_measured;
  for (const MeasuredBlock& m : options.measured) {
    measured_.at(std::size_t(m.problem)).push_back(m.block);
    is_measured.emplace(m.problem, m.block.pool, m.block.id);
    const Problem& problem = *problems[std::size_t(m.problem)];
    log_constant(problem.loss(m.block), static_cast<int>(problem.noise(m.block).dim()));  // refuses what is no density
  }
  for (Member& m : members_) {
    m.measured = is_measured.empty() || is_measured.contains({m.problem, m.block.pool, m.block.id});
    for (std::size_t i = 0; m.measured && i < m.group.size(); ++i) {
      if (m.group[i] < 0) continue;
      counted_[m.group[i]] += m.share[i];
      of_beliefs_[m.group[i]] = 0;
    }
  }
  if (options.counted_rows.size() > 0) counted_ = options.counted_rows;
  settled_at_.assign(problems.size(), Eigen::VectorXd::Zero(rows_.size()));
}

void Evidence::lay_out() {
  for (std::size_t p = settled_.size(); p < problems_.size(); ++p) {
    options_.stop.check("calibrate");
    settled_.push_back(std::make_unique<SettledProblem>(*problems_[p], options_, measured_[p]));
  }
}

bool Evidence::count_rows() {
  constexpr int kGrid = 64;
  std::map<std::tuple<Loss::Kind, double, Eigen::Index>, std::vector<double>> tables;  // over the share that is taken
  Eigen::VectorXd counted = Eigen::VectorXd::Zero(counted_.size());
  for (std::size_t p = 0; p < problems_.size(); ++p) {
    const Problem& problem = *problems_[p];
    const SettledProblem& settled = *settled_[p];
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
        const double taken = problem.weight(m.block) *
                             (J * settled.covariances().joint(at.variable_ids, at.dofs) * J.transpose()).trace();
        const double place = std::clamp(taken / double(n), 0.0, 1.0) * kGrid;
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
    problems_[std::size_t(m.problem)]->set_noise(m.block, m.given.scaled(factor));
  }
}

/// Far from the last factors by way of those in between.
bool Evidence::settle_by_steps(std::size_t p, const Eigen::VectorXd& from, const Eigen::VectorXd& to, int halvings) {
  set_noise(p, to);
  ++solves_;
  if (settled_[p]->settle_by_steps()) return true;
  if (halvings == 0) return false;
  const Eigen::VectorXd between = 0.5 * (from + to);
  return settle_by_steps(p, from, between, halvings - 1) && settle_by_steps(p, between, to, halvings - 1);
}

/// Where it cannot, the problem is where it was.
bool Evidence::settle(std::size_t p, const Eigen::VectorXd& log_factors) {
  SettledProblem& settled = *settled_[p];
  const auto settle_and_find = [&] {
    if (!settle_by_steps(p, settled_at_[p], log_factors, kHalvings)) {
      set_noise(p, log_factors);
      ++solves_;
      if (!settled.settle()) return false;
    }
    return settled.find_covariances();
  };
  if (!settle_and_find()) {
    settled.go_back();
    return false;
  }
  settled.keep_place();
  settled_at_[p] = log_factors;
  return true;
}

/// A block's rows in the gradient. With W = W₀ D⁻¹, D the factors, ∂(W r)/∂log D_i = −w_i r_i, w_i the column of W.
void Evidence::add(const Member& member, const SettledProblem& settled, const Tails& tails, Value& value) const {
  const Problem& problem = *problems_[std::size_t(member.problem)];
  const Problem::Linearization at = problem.linearization(member.block);
  const Eigen::MatrixXd W = problem.noise(member.block).sqrt_information();
  const double weight = problem.weight(member.block);
  const Eigen::MatrixXd& J = at.jacobian;
  Eigen::MatrixXd S = settled.covariances().joint(at.variable_ids, at.dofs);
  if (settled.has_beliefs())
    S -= (!member.measured          ? 1.0
          : options_.whole_integral ? 0.0
                                    : 1 / (kFaint * kFaint)) *
         settled.of_beliefs().joint(at.variable_ids, at.dofs);
  const Eigen::MatrixXd information = W.transpose() * W;
  Eigen::VectorXd squares = (information * at.residual).cwiseProduct(at.residual);
  Eigen::VectorXd tail = Eigen::VectorXd::Zero(squares.size());
  if (tails.any()) {
    S -= 2 * tails.by_hessian(at.variable_ids, at.dofs);
    tail = tails.by_noise(settled, member.block, at);
  }
  Eigen::VectorXd shares = (information * J * S).cwiseProduct(J).rowwise().sum();
  if (!member.measured && settled.beliefs_step().size() > 0) {
    const Eigen::VectorXd of_beliefs =
        at.residual + J * of_block(settled.program(), at.variable_ids, at.dofs, J.cols(), settled.beliefs_step());
    squares -= (information * of_beliefs).cwiseProduct(of_beliefs);
  }
  if (tails.of(member.block)) {
    const Loss loss = problem.loss(member.block);
    shares = expected_curvature(loss) * (shares - weight / (loss.scale * loss.scale) * shares.sum() * squares);
  }
  for (Eigen::Index i = 0; i < at.residual.size(); ++i) {
    const int g = member.group[std::size_t(i)];
    if (g < 0) continue;
    value.gradient[g] += weight * (squares[i] + shares[i]) + tail[i];
    value.effective_rows[g] -= weight * shares[i];
  }
}

void Evidence::add_information(const Member& member, Eigen::MatrixXd& pull, Eigen::MatrixXd& measured) const {
  const Problem& problem = *problems_[std::size_t(member.problem)];
  const Problem::Linearization at = problem.linearization(member.block);
  const Eigen::MatrixXd W = problem.noise(member.block).sqrt_information();
  const double weight = problem.weight(member.block);
  const auto& program = settled_[std::size_t(member.problem)]->program();
  const Eigen::MatrixXd WJ = W * at.jacobian, rows = W * at.residual.asDiagonal();  // r̃_g: the sum of g's columns
  const Eigen::MatrixXd pulls = weight * WJ.transpose() * rows, squares = weight * rows.transpose() * rows;
  for (Eigen::Index i = 0; i < at.residual.size(); ++i) {
    const int g = member.group[std::size_t(i)];
    if (g < 0) continue;
    add_of_block(program, at.variable_ids, at.dofs, pulls.col(i), pull.col(g));
    if (!member.measured) continue;
    for (Eigen::Index j = 0; j < at.residual.size(); ++j)
      if (const int h = member.group[std::size_t(j)]; h >= 0) measured(g, h) += squares(i, j);
  }
}

/// With y = J x + noise of covariance R and x ~ N(x₀, H_b⁻¹) by beliefs, V = R + J H_b⁻¹ Jᵀ, P y = V⁻¹ (y − J x₀) and V_g
/// its derivative, the average information is ½ (P y)ᵀ V_g P V_h P y. V_g P y is −2 R^½ r̃_g of what is measured and
/// 2 J H_b⁻¹ J̃ᵀ r̃_g of beliefs, which leaves 2 (S − Cᵀ H⁻¹ C), C the columns J̃ᵀ r̃_g and S = r̃_gᵀ r̃_h of what is measured,
/// c_gᵀ H_b⁻¹ c_h of beliefs.
std::optional<Eigen::MatrixXd> Evidence::information() {
  std::vector<Eigen::MatrixXd> pull;  // J̃ᵀ r̃_g of each problem
  for (const auto& settled : settled_)
    pull.push_back(Eigen::MatrixXd::Zero(settled->program().num_unknowns(), rows_.size()));
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(rows_.size(), rows_.size());
  for (const Member& m : members_) add_information(m, pull[std::size_t(m.problem)], sum);
  for (std::size_t p = 0; p < problems_.size(); ++p) {
    SettledProblem& settled = *settled_[p];
    Eigen::MatrixXd solved = pull[p];
    if (!settled.solve(solved, false)) return {};
    sum -= pull[p].transpose() * solved;
    if (!settled.has_beliefs()) continue;
    const Eigen::MatrixXd of_beliefs = pull[p] * of_beliefs_.asDiagonal();
    solved = of_beliefs;
    if (!settled.solve(solved, true)) return {};
    sum += of_beliefs.transpose() * solved;
  }
  return Eigen::MatrixXd(sum + sum.transpose());
}

/// In lanes whose parts are added in their order.
void Evidence::add_members(Value& value) const {
  std::array<Value, kMostLanes> parts;
  lanes_.run(kMostLanes, [&](int lane) {
    Value& part = parts[std::size_t(lane)];
    part.gradient = part.effective_rows = Eigen::VectorXd::Zero(rows_.size());
    const std::size_t begin = members_.size() * std::size_t(lane) / kMostLanes;
    const std::size_t end = members_.size() * std::size_t(lane + 1) / kMostLanes;
    for (std::size_t i = begin; i < end; ++i) {
      const auto p = std::size_t(members_[i].problem);
      add(members_[i], *settled_[p], tails_[p], part);
    }
  });
  for (const Value& part : parts) {
    value.gradient += part.gradient;
    value.effective_rows += part.effective_rows;
  }
}

Evidence::Value Evidence::at(const Eigen::VectorXd& log_factors) {
  lay_out();
  tails_.resize(problems_.size());
  Value value;
  value.gradient = -counted_;
  value.effective_rows = counted_;
  for (std::size_t p = 0; p < problems_.size(); ++p) {
    SettledProblem& settled = *settled_[p];
    if (!settle(p, log_factors)) {
      value.why = settled.why();
      return value;
    }
    value.log_evidence -= settled.cost() + 0.5 * settled.covariances().log_determinant();
    if (!tails_[p].find(settled)) {
      value.why = "the Hessian is singular to rounding";
      return value;
    }
    value.log_evidence += tails_[p].value();
    if (settled.has_beliefs())
      value.log_evidence += 0.5 * settled.of_beliefs().log_determinant() + settled.beliefs_cost();
  }
  add_members(value);
  for (Eigen::Index g = 0; g < rows_.size(); ++g) {
    value.log_evidence -= counted_[g] * log_factors[g];
    const double prior = groups_[std::size_t(g)].prior;
    if (prior > 0) {
      value.log_evidence -= 0.5 * log_factors[g] * log_factors[g] / (prior * prior);
      value.gradient[g] -= log_factors[g] / (prior * prior);
    }
  }
  value.usable = std::isfinite(value.log_evidence) && value.gradient.allFinite();
  return value;
}

}  // namespace tandem::detail
