#include <algorithm>
#include <mutex>

#include <tandem/solvers/ipopt_linear_solver.hpp>

// Ipopt 3.11 and 3.12 do not install the headers of their interface for linear solvers. They install those of the
// loader for the HSL library, which accepts functions with the calling convention of MA57.
#if !__has_include(<IpSparseSymLinearSolverInterface.hpp>)
#if __has_include(<HSLLoader.h>)
#include <HSLLoader.h>
#define TANDEM_IPOPT_HAS_HSL_LOADER
#endif

namespace tandem::detail {

#ifdef TANDEM_IPOPT_HAS_HSL_LOADER
namespace {

/// The functions have no user pointer, so each thread has its own solver. Null while the thread does not run
/// optimize().
thread_local BlockCholeskyInIpopt* current = nullptr;

/// Functions with the names and arguments of MA57 (HSL, MA57 package specification), as far as Ipopt uses them. Arrays
/// are numbered as in Fortran: INFO(k) is info[k − 1]. On a thread without a solver they report failure. A host
/// program that uses the real MA57 on such a thread at the same time thus gets a failed solve, not a crash.
struct Ma57 {
  static constexpr int kFailed = -1;
  static constexpr double kPivotTolerance = 1e-8;  ///< while Ipopt has not raised it

  /// Sets default controls. Ipopt sets cntl[0] to its option ma57_pivtol, and raises it if it requires a better
  /// solution.
  static void initialize(double* cntl, int* icntl) {
    std::fill_n(cntl, 5, 0.0);
    std::fill_n(icntl, 20, 0);
  }

  static void analyze(int* n, int* entries, const int* row, const int* column, int*, int*, int*, int*, int* info,
                      double*) {
    std::fill_n(info, 40, 0);
    info[8] = info[9] = 1;  // size of the caller's workspace, which is not used
    if (!current || !current->analyze(*n, *entries, row, column)) info[0] = kFailed;
  }

  static void factorize(int*, int*, double* values, double*, int*, int*, int*, int*, int*, int*, int*, double* cntl,
                        int* info, double*) {
    std::fill_n(info, 40, 0);
    bool inertia = false;
    if (!current || !current->factorize(values, cntl[0] > 1.5 * kPivotTolerance, inertia)) {
      info[0] = kFailed;
      return;
    }
    // Reports one negative eigenvalue too many if the inertia is wrong. Ipopt then regularises H, as it does with MA57.
    info[23] = current->num_constraints() + (inertia ? 0 : 1);
  }

  static void solve(int*, int*, double*, int*, int*, int*, int* sides, double* rhs, int* stride, double*, int*, int*,
                    int*, int* info) {
    std::fill_n(info, 40, 0);
    for (int k = 0; k < *sides; ++k)
      if (!current || !current->solve(rhs + std::ptrdiff_t(k) * *stride)) info[0] = kFailed;
  }

  /// Never called, because CondensedKkt allocates the factor.
  static void enlarge(int*, int*, int*, double*, int*, double*, int*, int*, int*, int*, int*, int*) {}
};

/// Installs the functions while at least one object exists. Afterwards a host's own use of ma57 loads HSL as usual.
class Installation {
 public:
  explicit Installation(BlockCholeskyInIpopt& solver) : previous_(current) {
    current = &solver;
    const std::scoped_lock lock(mutex());
    if (count()++ == 0) LSL_setMA57(Ma57::analyze, Ma57::factorize, Ma57::solve, Ma57::enlarge, Ma57::initialize);
  }
  ~Installation() {
    current = previous_;
    const std::scoped_lock lock(mutex());
    if (--count() == 0) LSL_setMA57(nullptr, nullptr, nullptr, nullptr, nullptr);
  }
  Installation(const Installation&) = delete;
  Installation& operator=(const Installation&) = delete;

 private:
  static std::mutex& mutex() {
    static std::mutex mutex;
    return mutex;
  }
  static int& count() {
    static int count = 0;
    return count;
  }

  BlockCholeskyInIpopt* previous_;
};

}  // namespace

bool BlockCholeskyInIpopt::available() { return true; }

void BlockCholeskyInIpopt::choose(Ipopt::IpoptApplication& app) {
  app.Options()->SetStringValue("linear_solver", "ma57");
  app.Options()->SetNumericValue("ma57_pivtol", Ma57::kPivotTolerance);
  app.Options()->SetStringValue("linear_system_scaling", "none");
  app.Options()->SetIntegerValue("min_refinement_steps", 0);  // refine only if the residual requires it
}

Ipopt::ApplicationReturnStatus BlockCholeskyInIpopt::optimize(Ipopt::IpoptApplication& app,
                                                              const Ipopt::SmartPtr<Ipopt::TNLP>& problem) {
  const Installation installation(*this);
  return app.OptimizeTNLP(problem);
}
#else
bool BlockCholeskyInIpopt::available() { return false; }

void BlockCholeskyInIpopt::choose(Ipopt::IpoptApplication&) {}

Ipopt::ApplicationReturnStatus BlockCholeskyInIpopt::optimize(Ipopt::IpoptApplication& app,
                                                              const Ipopt::SmartPtr<Ipopt::TNLP>& problem) {
  return app.OptimizeTNLP(problem);
}
#endif

}  // namespace tandem::detail
#endif
