#include <cctype>
#include <climits>
#include <cmath>
#include <cstdlib>
#include <mutex>
#include <optional>
#include <utility>

#include <IpIpoptApplication.hpp>
#include <IpRegOptions.hpp>
#include <dlfcn.h>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/evaluator_solve.hpp>
#include <tandem/solvers/first_order_check.hpp>
#include <tandem/solvers/ipopt.hpp>
#include <tandem/solvers/ipopt_linear_solver.hpp>
#include <tandem/solvers/ipopt_nlp.hpp>
#include <tandem/solvers/name_suggestions.hpp>
#include <tandem/solvers/stationary_violation.hpp>

namespace tandem {
namespace {

constexpr double kColdBarrier = 0.1;  // initial barrier parameter, Ipopt's default

/// Limit of the gradient of the Lagrangian, in the unknowns of IpoptNlp [standard deviations].
constexpr double kMaxDualInfeasibility = 1e-5;

/// Serialises whole solves with MUMPS, which keeps global state. Other linear solvers of Ipopt may do so too.
std::mutex& mumps_mutex() {
  static std::mutex mutex;
  return mutex;
}

/// Serialises the construction and destruction of Ipopt applications, which use global state.
std::mutex& application_mutex() {
  static std::mutex mutex;
  return mutex;
}

/// Returns the Ipopt option that is given and that block-cholesky does not use, or "".
std::string option_of_other_linear_solver(const IpoptOptions& options) {
  for (const char* key : {"linear_solver", "linear_system_scaling"})
    if (options.options.contains(key)) return key;
  return {};
}

/// Returns whether Tandem's linear solver is used.
bool uses_block_cholesky(const IpoptOptions& options) {
  return options.linear_solver != IpoptLinearSolver::mumps && detail::BlockCholeskyInIpopt::available() &&
         option_of_other_linear_solver(options).empty();
}

/// Throws Error if the library of a linear solver cannot be loaded. Ipopt would end the process.
void check_linear_solver(std::string name) {
  for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));  // Ipopt ignores case
  if (name == "ma57" && detail::BlockCholeskyInIpopt::available())
    throw BadInputError(
        "ipopt option linear_solver: block-cholesky, the default, replaces ma57; remove the option or use mumps");
  const char* library = name.starts_with("ma") ? "libhsl.so" : name.starts_with("pardiso") ? "libpardiso.so" : nullptr;
  if (name == "wsmp")
    throw BadInputError("ipopt option linear_solver: wsmp is not part of this build of Ipopt; use mumps");
  if (!library) return;
  if (void* handle = dlopen(library, RTLD_LAZY)) {
    dlclose(handle);
  } else {
    throw BadInputError("ipopt option linear_solver: " + name + " needs " + library +
                        ", which is not installed; use mumps");
  }
}

void set_option(Ipopt::IpoptApplication& app, const std::string& key, const std::string& value) {
  const auto option = app.RegOptions()->GetOption(key);
  if (!Ipopt::IsValid(option)) {
    std::vector<std::string> known;
    for (const auto& [name, registered] : app.RegOptions()->RegisteredOptionsList()) known.push_back(name);
    throw BadInputError("ipopt has no option '" + key + "'" + did_you_mean(key, known));
  }
  if (value.starts_with("equilibration") && option->Name() == "nlp_scaling_method")  // Ipopt would end the process
    throw BadInputError("ipopt option " + key + ": equilibration-based needs libhsl.so; use gradient-based");
  // Options may come from a run file of others: they must neither write files nor load libraries.
  if (option->Type() == Ipopt::OT_String &&
      (option->Name().find("file") != std::string::npos || option->Name().ends_with("lib")))
    throw BadInputError("ipopt option " + key + " is not supported, since it names a file; remove it");
  if (option->Name() == "linear_solver") check_linear_solver(value);  // the key may have a prefix, as in resto.tol
  char* end = nullptr;
  bool taken = false;
  switch (option->Type()) {
    case Ipopt::OT_Number: {
      const double number = std::strtod(value.c_str(), &end);
      taken = !value.empty() && *end == '\0' && !std::isnan(number) && option->IsValidNumberSetting(number) &&
              app.Options()->SetNumericValue(key, number);
      break;
    }
    case Ipopt::OT_Integer: {
      const long number = std::strtol(value.c_str(), &end, 10);
      const bool fits = number >= INT_MIN && number <= INT_MAX;
      taken = !value.empty() && *end == '\0' && fits && option->IsValidIntegerSetting(static_cast<int>(number)) &&
              app.Options()->SetIntegerValue(key, static_cast<int>(number));
      break;
    }
    default:
      taken = option->IsValidStringSetting(value) && app.Options()->SetStringValue(key, value);
  }
  if (!taken) throw BadInputError("ipopt option " + key + ": '" + value + "' is not a valid value");
}

void set_options(Ipopt::IpoptApplication& app, const IpoptOptions& options) {
  if (!(options.tolerance > 0) || options.max_iterations < 0)
    throw BadInputError("ipopt: tolerance must be positive, and max_iterations must not be negative");
  app.RethrowNonIpoptException(false);
  const auto set = [&](const char* key, const char* value) { app.Options()->SetStringValue(key, value); };
  set("sb", "yes");
  set("nlp_scaling_method", "none");  // IpoptNlp scales
  if (uses_block_cholesky(options)) {
    detail::BlockCholeskyInIpopt::choose(app);
    // Newton steps converge as fast with this tolerance as with Ipopt's 1e-10. Limited-memory steps do not.
    if (options.hessian != Hessian::limited_memory) app.Options()->SetNumericValue("residual_ratio_max", 1e-7);
  } else {
    set("linear_solver", "mumps");
  }
  app.Options()->SetIntegerValue("print_level", 0);
  app.Options()->SetNumericValue("tol", options.tolerance);
  app.Options()->SetNumericValue("constr_viol_tol", detail::kConstraintTolerance);
  app.Options()->SetNumericValue("bound_relax_factor", 0.0);  // relaxed bounds would allow violations
  app.Options()->SetNumericValue("acceptable_constr_viol_tol", detail::kConstraintTolerance);
  // Ipopt divides its dual tolerance by the size of the multipliers, which is unbounded if constraints are degenerate.
  for (const char* limit : {"dual_inf_tol", "acceptable_dual_inf_tol"})
    app.Options()->SetNumericValue(limit, std::max(kMaxDualInfeasibility, options.tolerance));
  app.Options()->SetIntegerValue("max_iter", options.max_iterations);
  if (options.hessian == Hessian::limited_memory) set("hessian_approximation", "limited-memory");
  for (const auto& [key, value] : options.options) set_option(app, key, value);
}

constexpr int kMaxRefinement = 50;   // iterations of the run with kNoScaling
constexpr double kNoScaling = 1e20;  // value of s_max with which tolerances do not grow with the multipliers

/// Ipopt application with the given options. Construction and destruction are serialised.
class Application {
 public:
  explicit Application(const IpoptOptions& options) {
    const std::lock_guard lock(application_mutex());
    app_ = new Ipopt::IpoptApplication(/*create_console_out=*/true, /*create_empty=*/false);
    try {
      set_options(*app_, options);
    } catch (...) {
      app_ = nullptr;  // while the lock is held
      throw;
    }
  }
  ~Application() {
    const std::lock_guard lock(application_mutex());
    app_ = nullptr;
  }
  Application(const Application&) = delete;
  Application& operator=(const Application&) = delete;
  Ipopt::IpoptApplication& operator*() const { return *app_; }
  Ipopt::IpoptApplication* operator->() const { return Ipopt::GetRawPtr(app_); }

 private:
  Ipopt::SmartPtr<Ipopt::IpoptApplication> app_;
};

std::string why_no_hessian(const Problem& problem, const IpoptOptions& options) {
  if (options.hessian != Hessian::limited_memory || problem.num_hard_blocks() == 0) return {};
  return "ipopt's limited-memory Hessian takes no hard constraints, because their Jacobian would be dense: use the "
         "gauss-newton or exact Hessian";
}

std::string why_no_linear_solver(const IpoptOptions& options) {
  if (options.linear_solver != IpoptLinearSolver::block_cholesky || uses_block_cholesky(options)) return {};
  if (const std::string key = option_of_other_linear_solver(options); !key.empty())
    return "ipopt's linear solver is given twice, as block-cholesky and by the Ipopt option " + key +
           ": use one of them";
  return "this version of Ipopt does not support block-cholesky: use mumps";
}

/// Returns an empty string, or the reason why the problem is not supported.
std::string why_not(const Problem& problem, const IpoptOptions& options) {
  for (const std::string& why :
       {why_no_linear_solver(options), why_no_hessian(problem, options), detail::why_unsolvable(problem)})
    if (!why.empty()) return why;
  return {};
}

/// Sets the options of a warm start with multipliers and barrier, or of a cold start. Keeps the options in `given`.
void choose_start(Ipopt::IpoptApplication& app, bool warm, double barrier,
                  const std::map<std::string, std::string>& given) {
  app.Options()->SetStringValue("warm_start_init_point", warm ? "yes" : "no");
  if (!given.contains("mu_init"))
    app.Options()->SetNumericValue("mu_init", warm ? std::max(barrier, 1e-9) : kColdBarrier);
  if (!warm) return;
  for (const char* push : {"warm_start_bound_push", "warm_start_bound_frac", "warm_start_slack_bound_push",
                           "warm_start_slack_bound_frac", "warm_start_mult_bound_push"})
    if (!given.contains(push)) app.Options()->SetNumericValue(push, 1e-9);
}

/// Returns whether Ipopt's verdict at X̄ is wrong.
bool is_wrongly_infeasible(NlpEvaluator& nlp, Ipopt::ApplicationReturnStatus status, double feasible) {
  if (status != Ipopt::Infeasible_Problem_Detected) return false;
  Eigen::VectorXd c(nlp.num_rows());
  nlp.constraints(c);
  return nlp.violation(c).size <= feasible || !detail::violation_is_stationary(nlp);
}

void end(detail::Session& session, Ipopt::ApplicationReturnStatus status) {
  switch (status) {
    case Ipopt::Solve_Succeeded:
      return session.end(Status::converged);
    case Ipopt::Solved_To_Acceptable_Level:
      return session.end(Status::converged, "found a stationary point within Ipopt's acceptable tolerances");
    case Ipopt::Infeasible_Problem_Detected:
      return session.end(Status::infeasible);
    case Ipopt::Maximum_Iterations_Exceeded:
      return session.end(Status::max_iterations);
    case Ipopt::Maximum_CpuTime_Exceeded:
      return session.end(Status::time_limit);
    case Ipopt::User_Requested_Stop:
      return session.end(Status::interrupted);
    case Ipopt::Search_Direction_Becomes_Too_Small:
      return session.end(Status::failed, "Ipopt's steps became too small before convergence");
    case Ipopt::Restoration_Failed:
      return session.end(Status::failed, "Ipopt's restoration phase found no point with less violation");
    case Ipopt::Diverging_Iterates:
      return session.end(Status::failed, "the iterates diverge");
    case Ipopt::Invalid_Number_Detected:
      return session.end(Status::failed,
                         "a residual or Jacobian is undefined or not finite at a point that Ipopt evaluates");
    case Ipopt::Invalid_Option:
      return session.end(Status::failed, "this build of Ipopt does not support one of the Ipopt options");
    case Ipopt::Not_Enough_Degrees_Of_Freedom:
      return session.end(Status::unsupported, "Ipopt reports fewer unknowns than equality constraints");
    default:
      return session.end(Status::failed, "Ipopt ended with status " + std::to_string(status));
  }
}

/// Returns whether the first-order conditions hold at X̄ with multipliers other than Ipopt's. Ipopt's tolerance grows with
/// its multipliers. True if the conditions cannot be checked.
bool is_stationary(NlpEvaluator& nlp) {
  constexpr double kStationary = 1e-4;  // [standard deviations]
  constexpr double kLeastCurvature = 1e-12;
  if (nlp.num_rows() == 0) return true;
  const auto check = detail::check_first_order(nlp, kLeastCurvature);
  return !check || check->stationarity <= kStationary;
}

/// Sets the message if a block at the best point explains the failure.
void explain(detail::Session& session, NlpEvaluator& nlp) {
  try {
    if (const std::string bad = nlp.describe_nonfinite_block(); !bad.empty())
      session.summary.message = "a cost or Jacobian is not finite, in " + bad;
  } catch (const UndefinedResidualError& e) {
    session.summary.message = std::string("a residual's derivatives are undefined: ") + e.what();
  }
}

}  // namespace

bool ipopt_available() { return true; }

std::string why_unsupported(const Problem& problem, const IpoptOptions& options) {
  const Application app(options);
  return why_not(problem, options);
}

namespace {

class IpoptSolve final : public detail::EvaluatorSolve {
 public:
  IpoptSolve(Problem& problem, const IpoptOptions& options) : EvaluatorSolve(problem), options_(options) {}
  Summary solve() override;

 private:
  const IpoptOptions& options_;
};

Summary IpoptSolve::solve() {
  const IpoptOptions& options = options_;
  const bool own_systems = uses_block_cholesky(options);
  std::unique_lock lock(mumps_mutex(), std::defer_lock);
  if (!own_systems) lock.lock();
  const Application app(options);
  if (const std::string why = why_not(problem(), options); !why.empty())
    return detail::rejection("ipopt", options, why);
  detail::Session session("ipopt", options);
  NlpEvaluator& nlp = evaluator(options.threads);
  if (!session.start(nlp, [&] { return nlp.cost(); })) return session.summary;
  double feasible = detail::kConstraintTolerance;
  app->Options()->GetNumericValue("constr_viol_tol", feasible, "");
  const Ipopt::SmartPtr<detail::IpoptNlp> tnlp = new detail::IpoptNlp(nlp, session, options, feasible);
  std::optional<detail::BlockCholeskyInIpopt> linear_solver;
  if (own_systems) linear_solver.emplace(nlp);
  Ipopt::Index most = options.max_iterations;
  app->Options()->GetIntegerValue("max_iter", most, "");  // may be given as an Ipopt option
  bool warm = options.from_multipliers && tnlp->load_multipliers();
  bool restarted = false, refined = false, absolute = false;
  while (!session.ended()) {
    tnlp->start();
    choose_start(*app, warm, tnlp->barrier(), options.options);
    const int left = most - session.summary.iterations;
    app->Options()->SetIntegerValue("max_iter", std::max(left, 0));
    auto status = app->Initialize("");
    if (status == Ipopt::Solve_Succeeded)
      status = linear_solver ? linear_solver->optimize(*app, Ipopt::GetRawPtr(tnlp))
                             : app->OptimizeTNLP(Ipopt::SmartPtr<Ipopt::TNLP>(Ipopt::GetRawPtr(tnlp)));
    // Without constraints, continue from the best point. With constraints it may be the initial guess, if that is
    // feasible.
    const bool again =
        tnlp->wants_recentering() && status == Ipopt::User_Requested_Stop && left > 0 && !session.ended();
    warm = true;
    const bool solved = status == Ipopt::Solve_Succeeded || status == Ipopt::Solved_To_Acceptable_Level;
    if (tnlp->error() && !nlp.is_current()) std::rethrow_exception(tnlp->error());
    nlp.move_to(solved || (again && nlp.num_rows() > 0) ? tnlp->current() : tnlp->best());
    nlp.recenter();
    if (tnlp->error()) std::rethrow_exception(tnlp->error());
    if (linear_solver && linear_solver->error()) std::rethrow_exception(linear_solver->error());
    if (again) continue;
    if (is_wrongly_infeasible(nlp, status, feasible)) {
      if (!std::exchange(restarted, true) && session.summary.iterations < most) {
        warm = false;
        continue;
      }
      session.end(Status::failed,
                  "Ipopt reports that the constraints are infeasible, but small steps still reduce their violation");
    }
    if (solved && tnlp->increase_cost_scale() && session.summary.iterations < most) {
      refined = true;
      continue;
    }
    if (solved && !absolute && session.summary.iterations < most && !is_stationary(nlp)) {
      if (!options.options.contains("s_max")) app->Options()->SetNumericValue("s_max", kNoScaling);
      most = std::min(most, session.summary.iterations + kMaxRefinement);
      refined = absolute = true;
      continue;
    }
    // After a run to a higher accuracy failed, the solution of the run before remains.
    end(session, refined ? Ipopt::Solve_Succeeded : status);
    if (session.summary.status == Status::failed) explain(session, nlp);
  }
  if (session.summary.converged()) tnlp->store_multipliers();
  session.conclude(nlp, 10 * feasible);
  session.summary.linear_solver_seconds = session.summary.seconds - session.summary.evaluation_seconds;
  return session.summary;
}

}  // namespace

Summary solve(Problem& problem, const IpoptOptions& options) { return IpoptSolve(problem, options).solve(); }

std::unique_ptr<detail::PersistentSolve> detail::analyse(Problem& problem, const IpoptOptions& options) {
  return std::make_unique<IpoptSolve>(problem, options);
}

}  // namespace tandem
