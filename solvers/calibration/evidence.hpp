#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <tandem/problem/lanes.hpp>
#include <tandem/solvers/calibration/calibrate.hpp>
#include <tandem/solvers/calibration/settled_problem.hpp>
#include <tandem/solvers/calibration/tails.hpp>

namespace tandem::detail {

/// The Laplace evidence of problems as a function of the logarithms of their noise groups' factors. See calibrate().
class Evidence {
 public:
  Evidence(std::span<Problem* const> problems, const std::vector<NoiseGroup>& groups,
           const CalibrationOptions& options);

  struct Value {
    double log_evidence = 0;
    Eigen::VectorXd gradient;  ///< by the factors' logarithms
    Eigen::VectorXd
        effective_rows;  ///< of each group: n − Σ ρ′ J Σ Jᵀ, n as losses count, Σ with what tails make of it; of beliefs
                         ///< what they have alone for n
    bool usable = false;  ///< every problem could be solved, and its Hessian inverted
    std::string why;      ///< it is not
  };
  /// Solves from where the problems are, and leaves them solved. Throws Stopped where it is to stop, also while it lays the
  /// problems out, the first time.
  Value at(const Eigen::VectorXd& log_factors);
  /// The average information of the factors' logarithms at the last point: the mean of the evidence's observed and
  /// expected curvature, of the data alone (Gilmour, Thompson & Cullis 1995, eq. 7). Nothing where it is not known: with
  /// hard blocks.
  std::optional<Eigen::MatrixXd> information();
  /// Counts the rows of robust blocks anew, by what the states take up of each at the solution where the problems are;
  /// returns whether that changes any group's count by more than a hundredth.
  bool count_rows();
  /// Gives the problems the noise of a point, without solving them.
  void set_noise(const Eigen::VectorXd& log_factors) {
    for (std::size_t p = 0; p < problems_.size(); ++p) set_noise(p, log_factors);
  }
  /// Of each group.
  const Eigen::VectorXd& rows() const { return rows_; }
  /// Of each group, what its rows count for under their losses.
  const Eigen::VectorXd& counted() const { return counted_; }
  int solves() const { return solves_; }

 private:
  struct Member {  // a block, and the group of each of its rows, −1 where it is in none
    Block block;
    int problem;
    Gaussian given;
    std::vector<int> group;
    std::vector<double> share;  // of a datum, each row
    bool measured = true;
  };
  void lay_out();
  void set_noise(std::size_t problem, const Eigen::VectorXd& log_factors);
  bool settle(std::size_t problem, const Eigen::VectorXd& log_factors);
  bool settle_by_steps(std::size_t problem, const Eigen::VectorXd& from, const Eigen::VectorXd& to, int halvings);
  void add_members(Value& value) const;
  void add(const Member& member, const SettledProblem& settled, const Tails& tails, Value& value) const;
  /// Adds J̃ᵀ r̃_g of the member, J̃ and r̃ whitened, r̃_g its rows in group g, to `pull`; r̃_gᵀ r̃_h, where it is measured, to
  /// `measured`.
  void add_information(const Member& member, Eigen::MatrixXd& pull, Eigen::MatrixXd& measured) const;

  std::span<Problem* const> problems_;
  const CalibrationOptions& options_;
  std::vector<std::vector<Block>> measured_;  // of each problem
  std::vector<std::unique_ptr<SettledProblem>> settled_;
  std::vector<Tails> tails_;                 // of each problem
  std::vector<Eigen::VectorXd> settled_at_;  // of each problem
  const std::vector<NoiseGroup>& groups_;
  std::vector<Member> members_;
  Eigen::VectorXd rows_, counted_;  // of each group; of what is measured, under the losses (counted_rows)
  Lanes lanes_;
  Eigen::VectorXd of_beliefs_;  // of each group, 1 where none of its rows is measured, else 0
  int solves_ = 0;
};

}  // namespace tandem::detail
