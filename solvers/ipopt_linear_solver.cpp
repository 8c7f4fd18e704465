#include <algorithm>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/ipopt_linear_solver.hpp>

#if __has_include(<HSLLoader.h>)
#include <HSLLoader.h>
#define TANDEM_IPOPT_HAS_HSL_LOADER
#endif

namespace tandem::detail {
namespace {

thread_local OwnLinearSolver* current = nullptr;

}  // namespace

/// Functions with MA57's names and arguments (HSL, MA57 package specification), for what of it Ipopt uses. Arrays are
/// Fortran's: INFO(k) is info[k − 1].
struct Ma57 {
  static constexpr int kFailed = -1;

  /// Controls: Ipopt sets cntl[0], the pivot tolerance, and raises it when it asks for a better solution.
  static void initialize(double* cntl, int* icntl) {
    std::fill_n(cntl, 5, 0.0);
    std::fill_n(icntl, 20, 0);
  }

  static void analyze(int* n, int* entries, const int* row, const int* column, int*, int*, int*, int*, int* info,
                      double*) {
    std::fill_n(info, 40, 0);
    info[8] = info[9] = 1;  // what it is to allocate for the factor, which is kept here
    guard(info, [&](OwnLinearSolver& solver) {
      if (!solver.kkt_.analyze(*n, *entries, row, column, 1))
        throw Error(
            "ipopt: an option that was passed on changes its linear systems, which block-cholesky cannot solve then; "
            "choose mumps");
    });
  }

  static void factorize(int*, int*, double* values, double*, int*, int*, int*, int*, int*, int*, int*, double* cntl,
                        int* info, double*) {
    std::fill_n(info, 40, 0);
    guard(info, [&](OwnLinearSolver& solver) {
      // One more than there should be where there are too many: Ipopt then adds to H, as it does with MA57.
      info[23] = solver.kkt_.num_constraints() + (solver.kkt_.factorize(values, cntl[0]) ? 0 : 1);
    });
  }

  static void solve(int*, int*, double*, int*, int*, int*, int* sides, double* rhs, int* stride, double*, int*, int*,
                    int*, int* info) {
    std::fill_n(info, 40, 0);
    guard(info, [&](OwnLinearSolver& solver) {
      for (int k = 0; k < *sides; ++k) solver.kkt_.solve(rhs + std::ptrdiff_t(k) * *stride);
    });
  }

  /// Never asked for: the factor has all the room that it needs.
  static void enlarge(int*, int*, int*, double*, int*, double*, int*, int*, int*, int*, int*, int*) {}

 private:
  template <class F>
  static void guard(int* info, F f) {
    OwnLinearSolver& solver = *current;
    if (!solver.error_) try {
        f(solver);
      } catch (...) {
        solver.error_ = std::current_exception();
      }
    if (solver.error_) info[0] = kFailed;
  }
};

#ifdef TANDEM_IPOPT_HAS_HSL_LOADER
bool OwnLinearSolver::available() { return true; }

void OwnLinearSolver::choose(Ipopt::IpoptApplication& app) {
  LSL_setMA57(Ma57::analyze, Ma57::factorize, Ma57::solve, Ma57::enlarge, Ma57::initialize);
  app.Options()->SetStringValue("linear_solver", "ma57");
  app.Options()->SetStringValue("linear_system_scaling", "none");
  app.Options()->SetIntegerValue("min_refinement_steps", 0);  // only where the residual asks for it
}
#else
bool OwnLinearSolver::available() { return false; }

void OwnLinearSolver::choose(Ipopt::IpoptApplication&) {}
#endif

OwnLinearSolver::OwnLinearSolver(const Program& program) : kkt_(program), outer_(current) { current = this; }

OwnLinearSolver::~OwnLinearSolver() { current = outer_; }

}  // namespace tandem::detail
