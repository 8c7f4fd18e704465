#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <tandem/lie/rn.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/problem/nlp_evaluator.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/solvers/augmented_lagrangian.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/solvers/ipopt.hpp>
#include <tandem/solvers/nlopt.hpp>

/// Provides all solvers behind one signature, and small problems with known solutions.
namespace tandem::testing {

using R1 = Rn<1>;

/// Options that tests set; each solver has its own defaults for the others.
struct Limits {
  std::optional<int> max_iterations{};
  std::optional<double> time_limit{};
  const std::atomic<bool>* stop = nullptr;
  std::function<void(const Progress&)> progress{};
  bool from_multipliers = false;
};

struct AnySolver {
  std::string name;
  bool hard;  ///< supports all kinds of hard constraints
  std::function<Summary(Problem&, const Limits&)> solve;

  Summary operator()(Problem& problem, const Limits& limits = {}) const { return solve(problem, limits); }
};
inline std::ostream& operator<<(std::ostream& out, const AnySolver& solver) { return out << solver.name; }

template <class Options>
AnySolver any_solver(const std::string& name, bool hard, Options options) {
  return {name, hard, [options](Problem& problem, const Limits& limits) {
            Options o = options;
            o.max_iterations = limits.max_iterations.value_or(o.max_iterations);
            o.time_limit = limits.time_limit.value_or(o.time_limit);
            o.stop = limits.stop;
            o.progress = limits.progress;
            o.from_multipliers = limits.from_multipliers;
            return solve(problem, o);
          }};
}

inline bool ipopt_present() { return ipopt_available(); }
inline bool nlopt_present() { return !nlopt_algorithms().empty(); }

inline AnySolver ipopt(Hessian hessian = Hessian::gauss_newton) {
  IpoptOptions options;
  options.hessian = hessian;
  const char* suffix = hessian == Hessian::automatic        ? "_automatic"
                       : hessian == Hessian::exact          ? "_exact"
                       : hessian == Hessian::limited_memory ? "_limited_memory"
                                                            : "";
  return any_solver(std::string("ipopt") + suffix, hessian != Hessian::limited_memory, options);
}
inline AnySolver ipopt_mumps() {
  IpoptOptions options;
  options.linear_solver = IpoptLinearSolver::mumps;
  return any_solver("ipopt_mumps", true, options);
}
inline AnySolver nlopt(const std::string& algorithm) {
  NloptOptions options;
  options.algorithm = algorithm;
  return any_solver("nlopt_" + algorithm, algorithm == "slsqp" || algorithm.starts_with("auglag"), options);
}

/// Returns the available solvers, including Ipopt with each Hessian and linear solver.
inline std::vector<AnySolver> main_solvers() {
  std::vector<AnySolver> solvers{
      any_solver("gauss_newton", false, GaussNewtonOptions{}),
      any_solver("augmented_lagrangian", true, AugmentedLagrangianOptions{}),
  };
  if (ipopt_present())
    for (const auto hessian : {Hessian::automatic, Hessian::gauss_newton, Hessian::exact, Hessian::limited_memory})
      solvers.push_back(ipopt(hessian));
  if (ipopt_present()) solvers.push_back(ipopt_mumps());
  if (nlopt_present())
    for (const char* algorithm : {"lbfgs", "slsqp", "auglag-lbfgs"}) solvers.push_back(nlopt(algorithm));
  return solvers;
}
inline std::vector<AnySolver> hard_solvers() {
  std::vector<AnySolver> solvers;
  for (const AnySolver& solver : main_solvers())
    if (solver.hard) solvers.push_back(solver);
  return solvers;
}
inline std::string name_of(const ::testing::TestParamInfo<AnySolver>& info) {
  std::string name = info.param.name;
  for (char& c : name)
    if (c == '-') c = '_';
  return name;
}

inline double cost_of(Problem& problem) { return NlpEvaluator(problem).cost(); }

/// Rosenbrock's function as residuals, r = (10 (y − x²), 1 − x), with its minimum at (1, 1).
struct Rosenbrock {
  static constexpr std::string_view name = "Rosenbrock";
  static constexpr int dim = 2;
  using States = std::tuple<R2>;
  void operator()(const R2& p, Vector<2>& r, Matrix<2, 2>* J = nullptr) const {
    const double x = p.vector()[0], y = p.vector()[1];
    r << 10.0 * (y - x * x), 1.0 - x;
    if (J) *J << -20.0 * x, 10.0, -1.0, 0.0;
  }
};

/// Residual ‖x‖².
struct SquaredNorm {
  static constexpr std::string_view name = "squared norm";
  static constexpr int dim = 1;
  using States = std::tuple<R3>;
  void operator()(const R3& p, Vector<1>& r, Matrix<1, 3>* J = nullptr) const {
    r[0] = p.vector().squaredNorm();
    if (J) *J = 2.0 * p.vector().transpose();
  }
};

/// Residual log x − log z, undefined for x ≤ 0.
struct Logarithm {
  static constexpr std::string_view name = "logarithm";
  static constexpr int dim = 1;
  using States = std::tuple<R1>;
  double z;
  void operator()(const R1& p, Vector<1>& r, Matrix<1, 1>* J = nullptr) const {
    const double x = p.vector()[0];
    if (!(x > 0)) throw Error("logarithm: undefined where x is not positive");
    r[0] = std::log(x / z);
    if (J) (*J)(0, 0) = 1.0 / x;
  }
};

/// Residual x, NaN for x > `at`.
struct Wall {
  static constexpr std::string_view name = "wall";
  static constexpr int dim = 1;
  using States = std::tuple<R1>;
  double at;
  void operator()(const R1& p, Vector<1>& r, Matrix<1, 1>* J = nullptr) const {
    r = p.vector();
    if (r[0] > at) r[0] = std::numeric_limits<double>::quiet_NaN();
    if (J) (*J)(0, 0) = 1.0;
  }
};

}  // namespace tandem::testing
