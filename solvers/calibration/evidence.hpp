#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <tandem/problem/parallel_tasks.hpp>
#include <tandem/solvers/calibration/calibrate.hpp>
#include <tandem/solvers/calibration/laplace_approximation.hpp>
#include <tandem/solvers/calibration/loss_terms.hpp>

namespace tandem::detail {

/// The Laplace evidence of problems as a function of the log factors of their noise groups. See calibrate(). Works on
/// copies of the problems.
class Evidence {
 public:
  Evidence(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups,
           const CalibrationOptions& options);

  struct Value {
    double log_evidence = 0;
    Eigen::VectorXd gradient;  ///< derivative by the log factors
    /// Degrees of freedom of each group, n − Σ ρ′ J Σ Jᵀ with n the counted rows, corrected for the change of the weights
    /// of robust losses. In a group without measurements, the trace under the priors alone replaces n.
    Eigen::VectorXd effective_rows;
    bool usable = false;       ///< every problem could be solved and its Hessian inverted
    std::string why;           ///< the reason if not usable
    std::string unobservable;  ///< the directions, if these are the reason
  };
  /// Evaluates the evidence. Solves the copies from their last solution. Throws Stopped on a stop request, also during
  /// the symbolic analysis of the first call.
  Value at(const Eigen::VectorXd& log_factors);
  /// Returns the average information of the log factors at the last point, n × n (Gilmour, Thompson & Cullis 1995, eq.
  /// 7). This is the mean of the observed and the expected curvature of the evidence, without priors. Empty with hard
  /// blocks.
  std::optional<Eigen::MatrixXd> information();
  /// Updates counted() from the leverage of the robust blocks at the current solution. Returns whether the count of any
  /// group changed by more than 1 %.
  bool count_rows();
  /// Sets the noise of the copies without solving them.
  void set_noise(const Eigen::VectorXd& log_factors) {
    for (std::size_t p = 0; p < problems_.size(); ++p) set_noise(p, log_factors);
  }
  /// Returns the copies, with the noise and the solution of the last evaluation.
  const std::vector<std::shared_ptr<Problem>>& problems() const { return problems_; }
  const Eigen::VectorXd& rows() const { return rows_; }        ///< number of rows of each group
  const Eigen::VectorXd& counted() const { return counted_; }  ///< measured rows of each group that the losses count
  int solves() const { return solves_; }

 private:
  struct Member {  // a block with rows in noise groups
    Block block;
    int problem;
    Gaussian given;
    std::vector<int> group;     // group of each row; −1: none
    std::vector<double> share;  // NoiseRows::share of each row
    bool measured = true;
  };
  void create_approximations();
  void set_noise(std::size_t problem, const Eigen::VectorXd& log_factors);
  bool update(std::size_t problem, const Eigen::VectorXd& log_factors);
  bool update_by_steps(std::size_t problem, const Eigen::VectorXd& from, const Eigen::VectorXd& to, int halvings);
  void add_members(Value& value) const;
  void add(const Member& member, const LaplaceApproximation& laplace, const LossTerms& losses, Value& value) const;
  /// Adds J̃ᵀ r̃_g to column g of `gradients` and, for a measurement, r̃_gᵀ r̃_h to `squares`. J̃ and r̃ are the
  /// whitened Jacobian and residual of the member; r̃_g is r̃ with zeros outside group g.
  void add_information(const Member& member, Eigen::MatrixXd& gradients, Eigen::MatrixXd& squares) const;

  std::vector<std::shared_ptr<Problem>> problems_;
  const CalibrationOptions& options_;
  // One entry per problem:
  std::vector<std::vector<Block>> measured_;
  std::vector<std::unique_ptr<LaplaceApproximation>> laplace_;
  std::vector<LossTerms> losses_;
  std::vector<Eigen::VectorXd> solved_at_;  // log factors
  const std::vector<NoiseGroup>& groups_;
  std::vector<Member> members_;
  // One entry per group:
  Eigen::VectorXd rows_, counted_;
  Eigen::VectorXd prior_only_;  // 1 if no row is measured, else 0
  TaskRunner task_runner_;
  int solves_ = 0;
};

}  // namespace tandem::detail
