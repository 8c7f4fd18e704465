#pragma once

#include <exception>
#include <limits>
#include <optional>

#include <IpTNLP.hpp>

#include <tandem/problem/program.hpp>
#include <tandem/solvers/best_point.hpp>
#include <tandem/solvers/ipopt.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem::detail {

/// A Program as Ipopt's TNLP. Work is cached per point. Nothing is thrown through Ipopt: `error()` holds what was.
///
/// The unknowns, started at 0, are δ in units of unit curvature at the start: stiff and slack directions then meet
/// Ipopt's tolerance and its regularisation alike. (Scaled here, since Ipopt's own scaling copies its matrices over and
/// over.) With limited-memory they are white, Lᵀ δ of the Hessian's factor L: six steps say little about chains whose
/// curvatures span many decades. There a constraint's Jacobian would be dense, so there are none.
class IpoptNlp final : public Ipopt::TNLP {
 public:
  /// `feasible` is the largest violation of a point that meets the constraints.
  IpoptNlp(Program& program, Session& session, const IpoptOptions& options, double feasible);

  /// Before a run from the program's X̄. The multipliers of the last one are kept.
  void start();
  /// The feasible iterate of least cost since the start; while there is none, that of least violation.
  const Eigen::VectorXd& best() const { return best_; }
  /// The run was stopped because its iterate has gone too far for the chart: go on from there.
  bool wants_recentering() const { return recenter_; }
  /// The last iterate; once a run is over, its final one.
  const Eigen::VectorXd& current() const { return current_; }
  double barrier() const { return barrier_; }
  /// Before the first run: the problem's multipliers. False when all are zero.
  bool take_multipliers();
  /// The problem gets those of the last run.
  void leave_multipliers() { program_.set_multipliers(lambda_); }
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
  /// exact_ becomes the Hessian of factor·cost + multipliers_ᵀ c.
  void need_exact(double factor);
  /// Of an iterate in Ipopt's unknowns, which becomes current_ as δ.
  void consider_best(const Eigen::VectorXd& iterate);
  void choose_unknowns();

  bool rests(double cost, double gradient);

  double feasible_;
  Program& program_;
  Session& session_;
  const IpoptOptions& options_;
  struct Entry {
    int at, row;  // of the pattern's values
  };
  std::vector<Entry> lower_triangle_;  // those on and below the diagonal
  std::vector<int> lower_start_;       // of each column in lower_triangle_
  std::vector<std::size_t> diagonal_;  // of each unknown, in lower_triangle_
  Eigen::VectorXd x_, current_, best_, gradient_, hessian_, exact_, multipliers_, constraints_, jacobian_, lambda_;
  std::optional<BlockCholesky> white_;
  Eigen::VectorXd unknowns_, iterate_, own_gradient_;  // Ipopt's; x_ is δ of unknowns_
  Eigen::VectorXd unit_;                               // δ of one of each unknown
  BestPoint best_point_{};
  int resting_ = 0;  // iterations since the cost was no more than this
  double resting_cost_ = std::numeric_limits<double>::infinity();
  double cost_ = 0, last_cost_ = 0, barrier_ = 0, damping_ = kInitialDamping;
  bool has_cost_ = false, has_derivatives_ = false, has_constraints_ = false, recenter_ = false, exact_now_;
  int first_iteration_ = 0;
  std::exception_ptr error_;
};

}  // namespace tandem::detail
