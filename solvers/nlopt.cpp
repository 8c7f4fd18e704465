#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <optional>
#include <stdexcept>

#include <nlopt.hpp>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/best_point.hpp>
#include <tandem/solvers/evaluator_solve.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>
#include <tandem/solvers/nlopt.hpp>
#include <tandem/solvers/nlopt_algorithms.hpp>
#include <tandem/solvers/session.hpp>
#include <tandem/solvers/span_of_rows.hpp>

namespace tandem {
namespace {

constexpr double kMaxConstraintEntries = 2e7;  // limit of NLopt's dense constraint Jacobian
// Gradient in white coordinates [standard deviations]; rounding may leave this much.
constexpr double kStationary = 1e-5;
constexpr double kCostErrorFactor = 100;  // Error of the cost of a slowly converging run, in units of its last change.
constexpr double kActive = 1e-6;          // Distance from its bound below which an inequality counts as active.
constexpr double kMaxStationarityWork = 1e10;  // Limit of the stationarity check [multiplications]; takes some seconds.
constexpr double kRecenterAngle = 1.0;         // [rad]; the chart ends at π.
constexpr double kPreconditionerDamping = 1e-9;  // Relative to the diagonal; covers rounding of pivots.
constexpr double kToleranceSlack = 10;           // NLopt's own slack, in constraint tolerances.
constexpr double kCostRounding = 1e-16;          // Absolute rounding error of a small cost.
constexpr double kSameCost = 1e-7;               // Relative cost difference of two runs to the same point.
constexpr double kPenaltyWeight = 100;  // Weight of Jᵀ J in the preconditioner of AUGLAG, about its final penalty.

/// Ends the solve with its message.
struct NonFinite : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Adapter of an NlpEvaluator to NLopt, in coordinates z with δ = P z. P is L⁻ᵀ of the Gauss-Newton Hessian at X̄, or
/// the identity. Exceptions are stored in error_, because they must not pass through NLopt.
class NloptRun {
 public:
  NloptRun(NlpEvaluator& nlp, detail::Session& session, const NloptOptions& options)
      : nlp_(nlp), session_(session), options_(options) {
    const int n = nlp.num_unknowns();
    for (Eigen::VectorXd* v : {&z_, &delta_, &gradient_, &best_delta_, &row_}) v->setZero(n);
    constraints_.setZero(nlp.num_rows());
    jacobian_.setZero(static_cast<Eigen::Index>(nlp.jacobian_pattern().row.size()));
    const auto& lower = nlp.lower();
    const auto& upper = nlp.upper();
    for (int i = 0; i < nlp.num_rows(); ++i) {
      if (lower[i] == upper[i]) {
        equalities_.push_back({i, 1.0, lower[i]});
      } else {
        if (std::isfinite(upper[i])) inequalities_.push_back({i, 1.0, upper[i]});
        if (std::isfinite(lower[i])) inequalities_.push_back({i, -1.0, -lower[i]});
      }
    }
    entries_of_row_.resize(std::size_t(nlp.num_rows()));
    for (std::size_t k = 0; k < nlp.jacobian_pattern().row.size(); ++k)
      entries_of_row_[std::size_t(nlp.jacobian_pattern().row[k])].push_back(k);
    hessian_.setZero(nlp.hessian_pattern().nonzeros());
    if (options.precondition) cholesky_.emplace(nlp.hessian_pattern());
  }

  /// Runs NLopt once from X̄. Returns true if another run must follow from the new X̄.
  bool run(const detail::NloptAlgorithm& algorithm) {
    recenter_ = false;
    best_delta_.setZero();
    best_ = {1.0};
    z_.setConstant(std::numeric_limits<double>::quiet_NaN());  // no cached point
    nlp_.reset();
    try {
      if (cholesky_) factorize(*cholesky_, algorithm.inner ? kPenaltyWeight : 0.0);
      nlp_.constraint_jacobian(jacobian_);
      tolerances_ = detail::row_tolerances(nlp_, jacobian_, options_.constraint_tolerance);
    } catch (const NonFinite& e) {
      session_.end(Status::failed, e.what());
      return false;
    } catch (const UndefinedResidualError& e) {
      session_.end(Status::failed, std::string("a residual is undefined at the start of a run: ") + e.what());
      return false;
    }

    const auto n = static_cast<unsigned>(nlp_.num_unknowns());
    nlopt::opt opt(algorithm.method, n);
    if (algorithm.inner) {
      nlopt::opt inner(*algorithm.inner, n);
      inner.set_ftol_rel(options_.cost_tolerance);
      inner.set_ftol_abs(kCostRounding);
      opt.set_local_optimizer(inner);
    }
    opt_ = &opt;
    opt.set_ftol_rel(options_.cost_tolerance);
    opt.set_ftol_abs(kCostRounding);
    opt.set_maxeval(std::max(1, options_.max_iterations - session_.summary.evaluations));
    opt.set_min_objective(&objective, this);
    const auto tolerances = [&](const std::vector<Row>& rows) {
      std::vector<double> result;
      for (const Row& r : rows) result.push_back(tolerances_[r.row]);
      return result;
    };
    if (!equalities_.empty()) opt.add_equality_mconstraint(&equalities, this, tolerances(equalities_));
    if (!inequalities_.empty()) opt.add_inequality_mconstraint(&inequalities, this, tolerances(inequalities_));

    std::vector<double> z(n, 0.0);
    double value = 0;
    bool gave_up = false, ended = false;
    try {
      ended = opt.optimize(z, value) != nlopt::MAXEVAL_REACHED;
      session_end_ = {ended ? Status::converged : Status::max_iterations, ended ? "the cost no longer changes" : ""};
    } catch (const nlopt::roundoff_limited&) {
      session_end_ = {Status::failed, "no step lowers the cost, but the point is not a minimum"};
      gave_up = true;
    } catch (const nlopt::forced_stop&) {
      session_end_ = {Status::interrupted, {}};
    } catch (const std::exception& e) {
      session_end_ = {Status::failed, std::string("NLopt gave up: ") + e.what()};
      gave_up = true;
    }
    opt_ = nullptr;
    if (error_ && !nlp_.is_current()) std::rethrow_exception(error_);
    nlp_.move_to(best_delta_);
    nlp_.recenter();
    if (error_) std::rethrow_exception(error_);
    if (recenter_) return true;
    // Line searches also fail at a solution, where the gradient is rounding. The point is a solution if the gradient
    // vanishes along the active constraints. A run that stopped elsewhere is repeated once.
    if ((gave_up || ended) && best_.violation <= kToleranceSlack && !(ended && stationary(true))) {
      if (!(std::abs(best_.cost - last_cost_) <= kSameCost * (1 + best_.cost))) {
        last_cost_ = best_.cost;
        return std::isfinite(best_.cost);
      }
      if (ended) {
        session_end_ = {Status::failed, "the cost no longer changes, but the gradient is above its tolerance"};
      } else if (stationary(false)) {
        session_end_ = {Status::converged, "no step lowers the cost any further"};
      }
    }
    session_.end(session_end_.status, session_end_.message);
    return false;
  }

 private:
  struct Row {  // constraint sign · c[row] − bound, = 0 or ≤ 0
    int row;
    double sign, bound;
  };
  struct Ending {
    Status status;
    std::string message;
  };

  /// Factorises the Hessian at X̄ plus `constraint_weight` times Jᵀ J of the constraints.
  void factorize(BlockCholesky& cholesky, double constraint_weight) {
    nlp_.linearize(gradient_, hessian_);
    check_finite_gradient();
    if (constraint_weight > 0) {
      nlp_.constraint_jacobian(jacobian_);
      has_jacobian_ = false;  // the stored Jacobian is not at the point
      nlp_.add_constraint_hessian(Eigen::VectorXd::Constant(nlp_.num_rows(), constraint_weight), jacobian_, hessian_);
    }
    Eigen::VectorXd diagonal(nlp_.num_unknowns());
    detail::hessian_diagonal(nlp_.hessian_pattern(), hessian_, diagonal);
    if (!cholesky.factorize_shifted(hessian_, std::move(diagonal), kPreconditionerDamping))
      throw NonFinite("the Jacobians are too large to be factorised");
  }

  void check_finite_gradient() {
    if (!std::isfinite(gradient_.sum()))
      throw NonFinite("a Jacobian is not finite, in " + nlp_.describe_nonfinite_block());
  }

  /// Returns whether the whitened gradient at X̄ is small after projection onto the null space of the active
  /// constraints. Half its squared norm is the predicted gain of a step. Returns `unknown` if the check would take too
  /// long.
  bool stationary(bool unknown) try {
    nlp_.reset();
    BlockCholesky white(nlp_.hessian_pattern());
    factorize(white, 0.0);
    nlp_.linearize_constraints(constraints_, jacobian_);
    white.solve_lower(gradient_);
    Eigen::MatrixXd active(gradient_.size(), 0);
    for (const auto* rows : {&equalities_, &inequalities_})
      for (const Row& r : *rows) {
        const double inside = r.bound - r.sign * constraints_[r.row];
        if (rows == &inequalities_ && inside > std::max(kActive, 100 * tolerances_[r.row])) continue;
        if (double(active.cols()) * double(active.cols()) * double(active.rows()) > kMaxStationarityWork)
          return unknown;
        set_row(r, &white);
        active.conservativeResize(Eigen::NoChange, active.cols() + 1);
        active.rightCols<1>() = row_.normalized();
      }
    gradient_ = detail::outside_span(std::move(active), Eigen::Index(equalities_.size()), gradient_);
    const double small = std::max(kStationary, std::sqrt(kCostErrorFactor * options_.cost_tolerance));
    return gradient_.norm() <= small * (1 + std::sqrt(best_.cost));
  } catch (const std::runtime_error&) {  // undefined or infinite derivatives
    return false;
  }

  void move(const double* z) {
    if (session_.ended()) return;  // some algorithms stop one evaluation late
    if (std::equal(z_.data(), z_.data() + z_.size(), z)) return;
    z_ = Eigen::Map<const Eigen::VectorXd>(z, z_.size());
    delta_ = z_;
    if (cholesky_) cholesky_->solve_transposed(delta_);
    has_gradient_ = has_jacobian_ = false;
    ++session_.summary.evaluations;
    session_.summary.iterations = session_.summary.evaluations;
    nlp_.move_to(delta_);
    cost_ = nlp_.cost();
    nlp_.constraints(constraints_);
    update_best();
  }

  /// Updates the best point, and stops NLopt if the caller or the chart requires it.
  void update_best() {
    const double violation = nlp_.violation(constraints_).size;
    if (best_.offer(cost_, detail::relative_violation(nlp_, constraints_, tolerances_).size)) {
      best_delta_ = delta_;
      if (nlp_.largest_angle() > kRecenterAngle) recenter_ = true;
    }
    try {
      session_.report_at(nlp_, delta_, session_.summary.iterations, cost_, std::numeric_limits<double>::quiet_NaN(),
                         violation);
    } catch (...) {  // an exception of the callback, not an undefined residual
      error_ = std::current_exception();
      opt_->force_stop();
      return;
    }
    if (session_.summary.evaluations >= options_.max_iterations) session_.end(Status::max_iterations);
    if (session_.should_stop() || session_.ended() || recenter_) opt_->force_stop();
  }

  /// Calls f. An undefined residual counts as an infinite cost, which line searches reject.
  template <class F>
  double guarded(F f) {
    const detail::Session::Timer timer(session_.summary.evaluation_seconds);
    try {
      return f();
    } catch (const UndefinedResidualError&) {
      z_.setConstant(std::numeric_limits<double>::quiet_NaN());
      if (session_.should_stop()) opt_->force_stop();
      return std::numeric_limits<double>::infinity();
    } catch (const NonFinite& e) {
      session_.end(Status::failed, e.what());
      opt_->force_stop();
      return 0.0;
    } catch (...) {
      error_ = std::current_exception();
      opt_->force_stop();
      return 0.0;
    }
  }

  static double objective(unsigned n, const double* z, double* gradient, void* self) {
    auto& run = *static_cast<NloptRun*>(self);
    if (gradient) std::fill_n(gradient, n, 0.0);  // returned if the cost is undefined
    return run.guarded([&] {
      run.move(z);
      if (gradient) {
        if (!run.has_gradient_) {
          run.nlp_.gradient(run.gradient_);
          if (std::isfinite(run.cost_)) run.check_finite_gradient();
          if (run.cholesky_) run.cholesky_->solve_lower(run.gradient_);
          run.has_gradient_ = true;
        }
        std::copy_n(run.gradient_.data(), n, gradient);
      }
      return run.cost_;
    });
  }

  static void equalities(unsigned, double* result, unsigned n, const double* z, double* gradient, void* self) {
    static_cast<NloptRun*>(self)->rows(static_cast<NloptRun*>(self)->equalities_, result, n, z, gradient);
  }
  static void inequalities(unsigned, double* result, unsigned n, const double* z, double* gradient, void* self) {
    static_cast<NloptRun*>(self)->rows(static_cast<NloptRun*>(self)->inequalities_, result, n, z, gradient);
  }

  void rows(const std::vector<Row>& rows, double* result, unsigned n, const double* z, double* gradient) {
    std::fill_n(result, rows.size(), std::numeric_limits<double>::infinity());  // returned if a row is undefined
    if (gradient) std::fill_n(gradient, rows.size() * n, 0.0);
    guarded([&] {
      move(z);
      if (gradient && !has_jacobian_) {
        nlp_.constraint_jacobian(jacobian_);
        has_jacobian_ = true;
      }
      for (std::size_t i = 0; i < rows.size(); ++i) {
        const Row& r = rows[i];
        result[i] = r.sign * constraints_[r.row] - r.bound;
        if (!gradient) continue;
        set_row(r, cholesky_ ? &*cholesky_ : nullptr);
        std::copy_n(row_.data(), n, gradient + i * n);
      }
      return 0.0;
    });
  }

  /// Sets row_ to the gradient of a constraint from jacobian_, in the white coordinates of the factor if there is one.
  void set_row(const Row& r, const BlockCholesky* white) {
    row_.setZero();
    for (const std::size_t k : entries_of_row_[std::size_t(r.row)])
      row_[nlp_.jacobian_pattern().column[k]] += r.sign * jacobian_[Eigen::Index(k)];
    if (white) white->solve_lower(row_);
  }

  NlpEvaluator& nlp_;
  detail::Session& session_;
  const NloptOptions& options_;
  std::optional<BlockCholesky> cholesky_;
  nlopt::opt* opt_ = nullptr;
  std::vector<Row> equalities_, inequalities_;
  std::vector<std::vector<std::size_t>> entries_of_row_;
  Eigen::VectorXd z_, delta_, gradient_, best_delta_, row_, constraints_, jacobian_, hessian_;
  Eigen::VectorXd tolerances_;  // of the rows, at the start of a run
  detail::BestPoint best_{};
  // Cost of the present point, and at the end of the last run.
  double cost_ = 0, last_cost_ = std::numeric_limits<double>::infinity();
  bool has_gradient_ = false, has_jacobian_ = false, recenter_ = false;
  Ending session_end_{Status::failed, {}};
  std::exception_ptr error_;
};

}  // namespace

std::string why_unsupported(const Problem& problem, const NloptOptions& options) {
  const detail::NloptAlgorithm& algorithm = detail::find_algorithm(options.algorithm);
  if (!(options.cost_tolerance >= 0) || !(options.constraint_tolerance >= 0))
    throw BadInputError("nlopt: tolerances must not be negative");
  if (const std::string why = detail::why_unsolvable(problem); !why.empty()) return why;
  const std::string name = std::string("nlopt:") + algorithm.name;
  const auto size = problem.size();
  if (size.equalities > size.unknowns)
    return name + " takes at most as many hard equalities (" + std::to_string(size.equalities) + ") as unknowns (" +
           std::to_string(size.unknowns) + "): use augmented-lagrangian or ipopt";
  if (size.equalities > 0 && !algorithm.equalities)
    return name + " takes no hard equalities, and this problem has " + std::to_string(size.equalities) +
           ": use nlopt:slsqp, nlopt:auglag-lbfgs or ipopt";
  if (size.inequalities > 0 && !algorithm.inequalities)
    return name + " takes no hard inequalities, and this problem has " + std::to_string(size.inequalities) +
           ": use nlopt:slsqp, nlopt:auglag-lbfgs or ipopt";
  if (algorithm.dense && size.unknowns > kMaxDenseUnknowns)
    return name + " works on dense matrices and takes " + std::to_string(kMaxDenseUnknowns) +
           " unknowns at most, not " + std::to_string(size.unknowns) +
           ": use nlopt:auglag-lbfgs or ipopt, or fewer keyframes";
  if (double(size.equalities + size.inequalities) * size.unknowns > kMaxConstraintEntries)
    return name + " keeps a dense constraint Jacobian, which would have " +
           std::to_string(size.equalities + size.inequalities) + " rows and " + std::to_string(size.unknowns) +
           " columns: use ipopt, or fewer keyframes";
  return {};
}

namespace {

std::string solver_name(const NloptOptions& options) {
  return std::string("nlopt:") + detail::find_algorithm(options.algorithm).name;
}

class NloptSolve final : public detail::EvaluatorSolve {
 public:
  NloptSolve(Problem& problem, const NloptOptions& options) : EvaluatorSolve(problem), options_(options) {}
  Summary solve() override;

 private:
  const NloptOptions& options_;
};

Summary NloptSolve::solve() {
  const NloptOptions& options = options_;
  const detail::NloptAlgorithm& algorithm = detail::find_algorithm(options.algorithm);
  detail::Session session(solver_name(options), options);
  NlpEvaluator& nlp = evaluator(options.threads);
  if (!session.start(nlp, [&] { return nlp.cost(); })) return session.summary;
  NloptRun run(nlp, session, options);
  while (run.run(algorithm)) {
    if (session.summary.evaluations >= options.max_iterations) session.end(Status::max_iterations);
    if (session.ended()) break;
  }
  session.conclude(nlp, kToleranceSlack * options.constraint_tolerance);
  return session.summary;
}

}  // namespace

Summary solve(Problem& problem, const NloptOptions& options) {
  if (const std::string why = why_unsupported(problem, options); !why.empty())
    return detail::rejection(solver_name(options), options, why);
  return NloptSolve(problem, options).solve();
}

std::unique_ptr<detail::PersistentSolve> detail::analyse(Problem& problem, const NloptOptions& options) {
  return std::make_unique<NloptSolve>(problem, options);
}

}  // namespace tandem
