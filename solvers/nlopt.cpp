#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <limits>
#include <optional>
#include <stdexcept>

#include <Eigen/QR>
#include <nlopt.hpp>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/best_point.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>
#include <tandem/solvers/linear/hessian_diagonal.hpp>
#include <tandem/solvers/near_names.hpp>
#include <tandem/solvers/nlopt.hpp>
#include <tandem/solvers/session.hpp>

namespace tandem {
namespace {

struct Algorithm {
  const char* name;
  nlopt::algorithm method;
  std::optional<nlopt::algorithm> inner;  // of AUGLAG
  bool equalities, inequalities, dense;   // what it takes; whether it keeps a dense matrix of all unknowns
};
const std::array kAlgorithms{
    Algorithm{"lbfgs", nlopt::LD_LBFGS, {}, false, false, false},
    Algorithm{"tnewton", nlopt::LD_TNEWTON, {}, false, false, false},
    Algorithm{"tnewton-restart", nlopt::LD_TNEWTON_RESTART, {}, false, false, false},
    Algorithm{"tnewton-precond", nlopt::LD_TNEWTON_PRECOND, {}, false, false, false},
    Algorithm{"tnewton-precond-restart", nlopt::LD_TNEWTON_PRECOND_RESTART, {}, false, false, false},
    Algorithm{"var1", nlopt::LD_VAR1, {}, false, false, false},
    Algorithm{"var2", nlopt::LD_VAR2, {}, false, false, false},
    Algorithm{"mma", nlopt::LD_MMA, {}, false, true, false},
    Algorithm{"ccsaq", nlopt::LD_CCSAQ, {}, false, true, false},
    Algorithm{"slsqp", nlopt::LD_SLSQP, {}, true, true, true},
    Algorithm{"auglag-lbfgs", nlopt::AUGLAG, nlopt::LD_LBFGS, true, true, false},
    Algorithm{"auglag-tnewton", nlopt::AUGLAG, nlopt::LD_TNEWTON_PRECOND_RESTART, true, true, false},
};

constexpr double kMostConstraintEntries = 2e7;  // NLopt wants constraint gradients as one dense matrix
constexpr double kStationary = 1e-5;            // whitened gradient, in standard deviations: rounding leaves no less
constexpr double kCostChanges = 100;    // that a point that creeps to its minimum may be off, by one of the last change
constexpr double kActive = 1e-6;        // how close to its bound an inequality counts as active
constexpr double kMostWork = 1e10;      // of the check for stationarity [multiplications]: some seconds
constexpr double kRecenterAngle = 1.0;  // rad: well before a chart ends at π
constexpr double kPreconditionerDamping = 1e-9;  // what rounding may take from a pivot
constexpr double kFeasible = 10;                 // constraint tolerances that a solution may be off: NLopt's own slack
constexpr double kNoCost = 1e-16;                // less is rounding, of rows within their standard deviations
constexpr double kSameCost = 1e-7;               // two runs that end this close, relatively, ended at one point
constexpr double kPenaltyWeight = 100;           // of Jᵀ J in AUGLAG's preconditioner: what its penalty grows to

const Algorithm& find_algorithm(const std::string& name) {
  const auto it = std::find_if(kAlgorithms.begin(), kAlgorithms.end(), [&](const auto& a) { return a.name == name; });
  if (it == kAlgorithms.end())
    throw Error("nlopt has no algorithm '" + name + "'" + did_you_mean(name, nlopt_algorithms()));
  return *it;
}

/// Thrown and caught below: ends the solve with its sentence.
struct NotFinite : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The Program as NLopt's functions, in coordinates z with δ = P z, where P is L⁻ᵀ of the Gauss-Newton Hessian at X̄
/// or the identity. Nothing is thrown through NLopt: what was is in error_.
class NloptRun {
 public:
  NloptRun(Program& program, detail::Session& session, const NloptOptions& options)
      : program_(program), session_(session), options_(options) {
    const int n = program.num_unknowns();
    for (Eigen::VectorXd* v : {&z_, &delta_, &gradient_, &best_delta_, &row_}) v->setZero(n);
    constraints_.setZero(program.num_rows());
    jacobian_.setZero(static_cast<Eigen::Index>(program.jacobian_pattern().row.size()));
    const auto& lower = program.lower();
    const auto& upper = program.upper();
    for (int i = 0; i < program.num_rows(); ++i) {
      if (lower[i] == upper[i]) {
        equalities_.push_back({i, 1.0, lower[i]});
      } else {
        if (std::isfinite(upper[i])) inequalities_.push_back({i, 1.0, upper[i]});
        if (std::isfinite(lower[i])) inequalities_.push_back({i, -1.0, -lower[i]});
      }
    }
    entries_of_row_.resize(std::size_t(program.num_rows()));
    for (std::size_t k = 0; k < program.jacobian_pattern().row.size(); ++k)
      entries_of_row_[std::size_t(program.jacobian_pattern().row[k])].push_back(k);
    hessian_.setZero(program.hessian_pattern().nonzeros());
    if (options.precondition) cholesky_.emplace(program.hessian_pattern());
  }

  /// One run from X̄; true when it must go on from a new centre.
  bool run(const Algorithm& algorithm) {
    recenter_ = false;
    best_delta_.setZero();
    best_ = {options_.constraint_tolerance};
    z_.setConstant(std::numeric_limits<double>::quiet_NaN());  // no point is cached
    program_.reset();
    try {
      if (cholesky_) factorize(*cholesky_, algorithm.inner ? kPenaltyWeight : 0.0);
    } catch (const NotFinite& e) {
      session_.end(Status::failed, e.what());
      return false;
    } catch (const Error& e) {
      session_.end(Status::failed, std::string("a residual is undefined where a run starts: ") + e.what());
      return false;
    }

    const auto n = static_cast<unsigned>(program_.num_unknowns());
    nlopt::opt opt(algorithm.method, n);
    if (algorithm.inner) {
      nlopt::opt inner(*algorithm.inner, n);
      inner.set_ftol_rel(options_.cost_tolerance);
      inner.set_ftol_abs(kNoCost);
      opt.set_local_optimizer(inner);
    }
    opt_ = &opt;
    opt.set_ftol_rel(options_.cost_tolerance);
    opt.set_ftol_abs(kNoCost);
    opt.set_maxeval(std::max(1, options_.max_iterations - session_.summary.evaluations));
    opt.set_min_objective(&objective, this);
    const auto tolerances = [&](std::size_t size) { return std::vector<double>(size, options_.constraint_tolerance); };
    if (!equalities_.empty()) opt.add_equality_mconstraint(&equalities, this, tolerances(equalities_.size()));
    if (!inequalities_.empty()) opt.add_inequality_mconstraint(&inequalities, this, tolerances(inequalities_.size()));

    std::vector<double> z(n, 0.0);
    double value = 0;
    bool gave_up = false, ended = false;
    try {
      ended = opt.optimize(z, value) != nlopt::MAXEVAL_REACHED;
      session_end_ = {ended ? Status::converged : Status::max_iterations, ended ? "the cost changes no more" : ""};
    } catch (const nlopt::roundoff_limited&) {
      session_end_ = {Status::failed, "no step lowers the cost, and it is no minimum"};
      gave_up = true;
    } catch (const nlopt::forced_stop&) {
      session_end_ = {Status::interrupted, {}};
    } catch (const std::exception& e) {
      session_end_ = {Status::failed, std::string("NLopt gave up: ") + e.what()};
      gave_up = true;
    }
    opt_ = nullptr;
    program_.move_to(best_delta_);
    program_.recenter();
    if (error_) std::rethrow_exception(error_);
    if (recenter_) return true;
    // Line searches fail at a solution too, where the gradient is rounding. It is one when nothing is left of the
    // gradient but what the active constraints hold; a run that only crawled is given a second chance.
    // So is one whose cost changes no more.
    if ((gave_up || ended) && best_.violation <= kFeasible * options_.constraint_tolerance &&
        !(ended && stationary(true))) {
      if (!(std::abs(best_.cost - last_cost_) <= kSameCost * (1 + best_.cost))) {
        last_cost_ = best_.cost;
        return std::isfinite(best_.cost);
      }
      if (ended) {
        session_end_ = {Status::failed, "the cost changes no more, but its gradient has not vanished"};
      } else if (stationary(false)) {
        session_end_ = {Status::converged, "no step lowers the cost any further"};
      }
    }
    session_.end(session_end_.status, session_end_.message);
    return false;
  }

 private:
  struct Row {  // sign · c[row] − bound, = 0 or ≤ 0
    int row;
    double sign, bound;
  };
  struct End {
    Status status;
    std::string message;
  };

  /// Of the Hessian at X̄, and that many times the constraints' Jᵀ J.
  void factorize(BlockCholesky& cholesky, double constraint_weight) {
    program_.linearize(gradient_, hessian_);
    check_finite_gradient();
    if (constraint_weight > 0) {
      program_.constraint_jacobian(jacobian_);
      has_jacobian_ = false;  // of the point
      program_.add_constraint_hessian(Eigen::VectorXd::Constant(program_.num_rows(), constraint_weight), jacobian_,
                                      hessian_);
    }
    Eigen::VectorXd shift(program_.num_unknowns());
    detail::hessian_diagonal(program_.hessian_pattern(), hessian_, shift);
    for (double& d : shift) d = d > 0 ? kPreconditionerDamping * d : 1.0;
    while (!cholesky.factorize(hessian_, shift)) {
      shift *= 10;
      if (!shift.allFinite()) throw NotFinite("the Jacobians are too large to be factorised");
    }
  }

  void check_finite_gradient() {
    if (!std::isfinite(gradient_.sum()))
      throw NotFinite("a Jacobian is not finite, in " + program_.describe_bad_block());
  }

  /// Whether the gradient at X̄, in the coordinates that whiten the Hessian there and less its part along the active
  /// constraints, is small: what a step along it would gain is half its square. `unknown` where that is too much work.
  bool stationary(bool unknown) try {
    program_.reset();
    BlockCholesky white(program_.hessian_pattern());
    factorize(white, 0.0);
    program_.linearize_constraints(constraints_, jacobian_);
    white.solve_lower(gradient_);
    Eigen::MatrixXd active(gradient_.size(), 0);
    for (const auto* rows : {&equalities_, &inequalities_})
      for (const Row& r : *rows) {
        if (rows == &inequalities_ && r.sign * constraints_[r.row] - r.bound < -kActive) continue;
        if (double(active.cols()) * double(active.cols()) * double(active.rows()) > kMostWork) return unknown;
        set_row(r, &white);
        active.conservativeResize(Eigen::NoChange, active.cols() + 1);
        active.rightCols<1>() = row_;
      }
    if (active.cols() > 0) gradient_ -= active * active.colPivHouseholderQr().solve(gradient_);
    const double small = std::max(kStationary, std::sqrt(kCostChanges * options_.cost_tolerance));
    return gradient_.norm() <= small * (1 + std::sqrt(best_.cost));
  } catch (const Error&) {  // undefined derivatives tell nothing
    return false;
  } catch (const NotFinite&) {
    return false;
  }

  void move(const double* z) {
    if (session_.ended()) return;  // some algorithms notice their stop one evaluation late
    if (std::equal(z_.data(), z_.data() + z_.size(), z)) return;
    z_ = Eigen::Map<const Eigen::VectorXd>(z, z_.size());
    delta_ = z_;
    if (cholesky_) cholesky_->solve_transposed(delta_);
    has_gradient_ = has_jacobian_ = false;
    ++session_.summary.evaluations;
    session_.summary.iterations = session_.summary.evaluations;
    program_.move_to(delta_);
    cost_ = program_.cost();
    program_.constraints(constraints_);
    consider();
  }

  /// Keeps the best point and stops where the caller or the chart asks for it.
  void consider() {
    const double violation = program_.violation(constraints_).size;
    if (best_.offer(cost_, violation)) {
      best_delta_ = delta_;
      if (program_.largest_angle() > kRecenterAngle) recenter_ = true;
    }
    try {
      session_.report_at(program_, delta_, session_.summary.iterations, cost_, std::numeric_limits<double>::quiet_NaN(),
                         violation);
    } catch (...) {  // the caller's, whatever its type: no undefined residual
      error_ = std::current_exception();
      opt_->force_stop();
      return;
    }
    if (session_.summary.evaluations >= options_.max_iterations) session_.end(Status::max_iterations);
    if (session_.should_stop() || session_.ended() || recenter_) opt_->force_stop();
  }

  /// Runs f; an undefined residual is an infinite cost, from which line searches turn back.
  template <class F>
  double guarded(F f) {
    const detail::Session::Timer timer(session_.summary.evaluation_seconds);
    try {
      return f();
    } catch (const Error&) {
      z_.setConstant(std::numeric_limits<double>::quiet_NaN());
      if (session_.should_stop()) opt_->force_stop();
      return std::numeric_limits<double>::infinity();
    } catch (const NotFinite& e) {
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
    if (gradient) std::fill_n(gradient, n, 0.0);  // where the cost is undefined
    return run.guarded([&] {
      run.move(z);
      if (gradient) {
        if (!run.has_gradient_) {
          run.program_.gradient(run.gradient_);
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
    std::fill_n(result, rows.size(), std::numeric_limits<double>::infinity());  // where they are undefined
    if (gradient) std::fill_n(gradient, rows.size() * n, 0.0);
    guarded([&] {
      move(z);
      if (gradient && !has_jacobian_) {
        program_.constraint_jacobian(jacobian_);
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

  /// row_ = the gradient of a constraint in the coordinates that are white to a factor, out of jacobian_.
  void set_row(const Row& r, const BlockCholesky* white) {
    row_.setZero();
    for (const std::size_t k : entries_of_row_[std::size_t(r.row)])
      row_[program_.jacobian_pattern().column[k]] += r.sign * jacobian_[Eigen::Index(k)];
    if (white) white->solve_lower(row_);
  }

  Program& program_;
  detail::Session& session_;
  const NloptOptions& options_;
  std::optional<BlockCholesky> cholesky_;
  nlopt::opt* opt_ = nullptr;
  std::vector<Row> equalities_, inequalities_;
  std::vector<std::vector<std::size_t>> entries_of_row_;
  Eigen::VectorXd z_, delta_, gradient_, best_delta_, row_, constraints_, jacobian_, hessian_;
  detail::BestPoint best_{};
  double cost_ = 0, last_cost_ = std::numeric_limits<double>::infinity();  // the second, where the last run ended
  bool has_gradient_ = false, has_jacobian_ = false, recenter_ = false;
  End session_end_{Status::failed, {}};
  std::exception_ptr error_;
};

}  // namespace

std::vector<std::string> nlopt_algorithms() {
  std::vector<std::string> names;
  for (const auto& a : kAlgorithms) names.emplace_back(a.name);
  return names;
}

std::string why_unsupported(const Problem& problem, const NloptOptions& options) {
  const Algorithm& algorithm = find_algorithm(options.algorithm);
  if (!(options.cost_tolerance >= 0) || !(options.constraint_tolerance >= 0))
    throw Error("nlopt: tolerances must not be negative");
  if (const std::string why = detail::why_unsolvable(problem); !why.empty()) return why;
  const std::string name = std::string("nlopt:") + algorithm.name;
  const auto size = problem.size();
  if (size.equalities > 0 && !algorithm.equalities)
    return name + " takes no hard equalities, and this problem has " + std::to_string(size.equalities) +
           ": use nlopt:slsqp, nlopt:auglag-lbfgs or ipopt";
  if (size.inequalities > 0 && !algorithm.inequalities)
    return name + " takes no hard inequalities, and this problem has " + std::to_string(size.inequalities) +
           ": use nlopt:slsqp, nlopt:auglag-lbfgs or ipopt";
  if (algorithm.dense && size.unknowns > kMostDenseUnknowns)
    return name + " works on dense matrices and takes " + std::to_string(kMostDenseUnknowns) +
           " unknowns at most, not " + std::to_string(size.unknowns) +
           ": use nlopt:auglag-lbfgs or ipopt, or fewer keyframes";
  if (double(size.equalities + size.inequalities) * size.unknowns > kMostConstraintEntries)
    return name + " keeps a dense constraint Jacobian, which would be of " +
           std::to_string(size.equalities + size.inequalities) + " rows and " + std::to_string(size.unknowns) +
           " columns here: use ipopt, or fewer keyframes";
  return {};
}

Summary solve(Problem& problem, const NloptOptions& options) {
  const Algorithm& algorithm = find_algorithm(options.algorithm);
  detail::Session session(std::string("nlopt:") + algorithm.name, options);
  if (const std::string why = why_unsupported(problem, options); !why.empty()) {
    session.end(Status::unsupported, why);
    return session.summary;
  }
  Program program(problem);
  program.use_threads(options.threads);
  if (!session.start(program, [&] { return program.cost(); })) return session.summary;
  NloptRun run(program, session, options);
  while (run.run(algorithm)) {
    if (session.summary.evaluations >= options.max_iterations) session.end(Status::max_iterations);
    if (session.ended()) break;
  }
  session.conclude(program, kFeasible * options.constraint_tolerance);
  return session.summary;
}

}  // namespace tandem
