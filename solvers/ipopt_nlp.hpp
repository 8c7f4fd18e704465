#pragma once

#include <exception>
#include <limits>
#include <optional>

#include <IpTNLP.hpp>

#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/solvers/best_point.hpp>
#include <tandem/solvers/ipopt.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>
#include <tandem/solvers/linear/condensed_kkt.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem::detail {

/// Adapter of an NlpEvaluator to Ipopt's TNLP. Evaluations are cached per point. Exceptions are stored in error(),
/// because they must not pass through Ipopt.
///
/// The unknowns are δ, scaled to unit curvature at the initial guess, and start at 0. Ipopt's tolerance and
/// regularisation then treat stiff and slack directions alike. The cost is scaled up if it is small, because Ipopt's
/// barrier adds an absolute error. Scaling is done here because Ipopt's own scaling copies its matrices repeatedly.
///
/// With the limited-memory Hessian, the unknowns are whitened, Lᵀ δ with the factor L of the Hessian: its six steps
/// cannot represent a chain whose curvatures span many decades. Constraints are not supported there, because their
/// Jacobian would be dense.
class IpoptNlp final : public Ipopt::TNLP {
 public:
  /// `feasible` is the tolerance on the violation of a feasible point.
  IpoptNlp(NlpEvaluator& nlp, Session& session, const IpoptOptions& options, double feasible);

  /// Prepares a run from X̄. Keeps the multipliers of the last run.
  void start();
  /// Best iterate since start(): the feasible one with the least cost or, without one, the one with the least
  /// violation.
  const Eigen::VectorXd& best() const { return best_; }
  /// Whether the run was stopped because its iterate had left the valid range of the chart. Continue from current().
  bool wants_recentering() const { return recenter_; }
  /// Last iterate; after a run, the final one.
  const Eigen::VectorXd& current() const { return current_; }
  double barrier() const { return barrier_; }
  /// After a successful run, with X̄ at its solution: scales the cost up and returns true if the error of the cost by
  /// the barrier is not negligible. Another run from X̄ then reduces it.
  bool increase_cost_scale();
  /// Loads the multipliers of the problem, before the first run. Returns false if all are zero.
  bool load_multipliers();
  /// Stores the multipliers of the last run, with X̄ at its solution, in the problem; 0 for inactive inequalities.
  void store_multipliers();
  std::exception_ptr error() const { return error_; }

 private:
  static constexpr double kInitialDamping = 1e-5;

  using Index = Ipopt::Index;
  using Number = Ipopt::Number;

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac, Index& nnz_hess, IndexStyleEnum& style) override;
  bool get_bounds_info(Index n, Number* lower, Number* upper, Index m, Number* c_lower, Number* c_upper) override;
  bool get_starting_point(Index n, bool init_x, Number* x, bool init_z, Number* z_lower, Number* z_upper, Index m,
                          bool init_lambda, Number* lambda) override;
  bool eval_f(Index n, const Number* x, bool new_x, Number& value) override;
  bool eval_grad_f(Index n, const Number* x, bool new_x, Number* gradient) override;
  bool eval_g(Index n, const Number* x, bool new_x, Index m, Number* g) override;
  bool eval_jac_g(Index n, const Number* x, bool new_x, Index m, Index nnz, Index* row, Index* column,
                  Number* values) override;
  bool eval_h(Index n, const Number* x, bool new_x, Number factor, Index m, const Number* lambda, bool new_lambda,
              Index nnz, Index* row, Index* column, Number* values) override;
  void finalize_solution(Ipopt::SolverReturn status, Index n, const Number* x, const Number* z_lower,
                         const Number* z_upper, Index m, const Number* g, const Number* lambda, Number value,
                         const Ipopt::IpoptData* data, Ipopt::IpoptCalculatedQuantities* quantities) override;
  bool intermediate_callback(Ipopt::AlgorithmMode mode, Index iteration, Number value, Number primal, Number dual,
                             Number mu, Number step, Number regularization, Number alpha_dual, Number alpha_primal,
                             Index trials, const Ipopt::IpoptData* data,
                             Ipopt::IpoptCalculatedQuantities* quantities) override;

  template <class F>
  bool evaluate(const Number* x, bool new_x, F f);
  void need_cost();
  void need_derivatives();
  void need_constraints();
  /// Sets exact_ to the Hessian of factor·cost + multipliers_ᵀ c.
  void need_exact(double factor);
  /// Compares an iterate in Ipopt's unknowns with the best one, and sets current_ to its δ.
  void consider_best(const Eigen::VectorXd& iterate);
  void choose_unknowns();
  void choose_cost_scale();
  double cost_to_become_feasible();
  void set_cost_scale(double scale);

  bool stagnates(double cost, double gradient);

  double feasible_;
  const int padding_;         // unknowns that nothing reads, see CondensedKkt::num_padding()
  double cost_scale_ = 1;     // ratio of Ipopt's cost to the cost
  double expected_cost_ = 0;  // order of magnitude of the cost at the solution, from the first initial guess
  NlpEvaluator& nlp_;
  Session& session_;
  const IpoptOptions& options_;
  struct Entry {
    int at, row;  // index of the value in the pattern, and row
  };
  std::vector<Entry> lower_triangle_;  // entries on and below the diagonal
  std::vector<int> lower_start_;       // start of each column in lower_triangle_
  std::vector<std::size_t> diagonal_;  // index of each unknown's diagonal entry in lower_triangle_
  Eigen::VectorXd x_, current_, best_, gradient_, hessian_, exact_, multipliers_, constraints_, jacobian_, lambda_;
  std::optional<BlockCholesky> white_;
  Eigen::VectorXd unknowns_, iterate_, own_gradient_;  // Ipopt's unknowns; x_ is their δ
  Eigen::VectorXd unit_;                               // δ per unit of each unknown
  BestPoint best_point_{};
  int stagnant_iterations_ = 0;  // iterations since the cost fell below stagnant_cost_
  double stagnant_cost_ = std::numeric_limits<double>::infinity();
  double cost_ = 0, last_cost_ = 0, barrier_ = 0, damping_ = kInitialDamping;
  bool has_cost_ = false, has_derivatives_ = false, has_constraints_ = false, recenter_ = false, exact_now_;
  int first_iteration_ = 0;
  std::exception_ptr error_;
};

}  // namespace tandem::detail
