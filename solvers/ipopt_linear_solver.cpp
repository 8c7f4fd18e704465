#include <vector>

#include <tandem/lie/error.hpp>
#include <tandem/solvers/ipopt_linear_solver.hpp>

#if __has_include(<IpSparseSymLinearSolverInterface.hpp>) && __has_include(<IpAlgBuilder.hpp>)
#include <IpAlgBuilder.hpp>
#include <IpSparseSymLinearSolverInterface.hpp>
#include <IpTNLPAdapter.hpp>
#include <IpTSymLinearSolver.hpp>
#define TANDEM_IPOPT_HAS_SOLVER_INTERFACE
#endif

namespace tandem::detail {

template <class F>
bool BlockCholeskyInIpopt::guard(F f) {
  if (!error_) try {
      f();
    } catch (...) {
      error_ = std::current_exception();
    }
  return !error_;
}

bool BlockCholeskyInIpopt::analyze(int size, int entries, const int* row, const int* column) {
  return guard([&] {
    if (!kkt_.analyze(size, entries, row, column, 1))
      throw BadInputError(
          "ipopt: an Ipopt option changes the structure of the linear systems, which block-cholesky does not support; "
          "use mumps");
  });
}

bool BlockCholeskyInIpopt::factorize(const double* values, bool pivoted, bool& inertia) {
  return guard([&] { inertia = kkt_.factorize(values, pivoted); });
}

bool BlockCholeskyInIpopt::solve(double* rhs) {
  return guard([&] { kkt_.solve(rhs); });
}

#ifdef TANDEM_IPOPT_HAS_SOLVER_INTERFACE
namespace {

class LinearSolver : public Ipopt::SparseSymLinearSolverInterface {
 public:
  explicit LinearSolver(BlockCholeskyInIpopt& solver) : solver_(solver) {}

  bool InitializeImpl(const Ipopt::OptionsList&, const std::string&) override {
    pivoted_ = false;
    return true;
  }

  Ipopt::ESymSolverStatus InitializeStructure(Ipopt::Index size, Ipopt::Index entries, const Ipopt::Index* row,
                                              const Ipopt::Index* column) override {
    size_ = size;
    values_.resize(std::size_t(entries));
    return solver_.analyze(size, entries, row, column) ? Ipopt::SYMSOLVER_SUCCESS : Ipopt::SYMSOLVER_FATAL_ERROR;
  }

  Ipopt::Number* GetValuesArrayPtr() override { return values_.data(); }

  Ipopt::ESymSolverStatus MultiSolve(bool new_matrix, const Ipopt::Index*, const Ipopt::Index*, Ipopt::Index sides,
                                     Ipopt::Number* rhs, bool check_inertia, Ipopt::Index negative) override {
    if (new_matrix || pivoted_changed_) {
      pivoted_changed_ = false;
      bool inertia = false;
      if (!solver_.factorize(values_.data(), pivoted_, inertia)) return Ipopt::SYMSOLVER_FATAL_ERROR;
      // Reports one negative eigenvalue too many if the inertia is wrong. Ipopt then regularises H.
      negative_ = solver_.num_constraints() + (inertia ? 0 : 1);
    }
    if (check_inertia && negative != negative_) return Ipopt::SYMSOLVER_WRONG_INERTIA;
    for (Ipopt::Index k = 0; k < sides; ++k)
      if (!solver_.solve(rhs + std::ptrdiff_t(k) * size_)) return Ipopt::SYMSOLVER_FATAL_ERROR;
    return Ipopt::SYMSOLVER_SUCCESS;
  }

  Ipopt::Index NumberOfNegEVals() const override { return negative_; }

  bool IncreaseQuality() override {
    if (pivoted_) return false;
    pivoted_ = pivoted_changed_ = true;
    return true;
  }

  bool ProvidesInertia() const override { return true; }
  EMatrixFormat MatrixFormat() const override { return Triplet_Format; }

 private:
  BlockCholeskyInIpopt& solver_;
  std::vector<Ipopt::Number> values_;
  bool pivoted_ = false, pivoted_changed_ = false;
  Ipopt::Index size_ = 0, negative_ = 0;
};

class Builder : public Ipopt::AlgorithmBuilder {
 public:
  explicit Builder(BlockCholeskyInIpopt& solver) : solver_(solver) {}

  Ipopt::SmartPtr<Ipopt::SymLinearSolver> SymLinearSolverFactory(const Ipopt::Journalist&, const Ipopt::OptionsList&,
                                                                 const std::string&) override {
    return new Ipopt::TSymLinearSolver(new LinearSolver(solver_), nullptr);
  }

 private:
  BlockCholeskyInIpopt& solver_;
};

}  // namespace

bool BlockCholeskyInIpopt::available() { return true; }

void BlockCholeskyInIpopt::choose(Ipopt::IpoptApplication& app) {
  app.Options()->SetIntegerValue("min_refinement_steps", 0);  // refine only if the residual requires it
}

Ipopt::ApplicationReturnStatus BlockCholeskyInIpopt::optimize(Ipopt::IpoptApplication& app,
                                                              const Ipopt::SmartPtr<Ipopt::TNLP>& problem) {
  const Ipopt::SmartPtr<Ipopt::NLP> nlp =
      new Ipopt::TNLPAdapter(problem, Ipopt::SmartPtr<const Ipopt::Journalist>(Ipopt::GetRawPtr(app.Jnlst())));
  Ipopt::SmartPtr<Ipopt::AlgorithmBuilder> builder = new Builder(*this);
  return app.OptimizeNLP(nlp, builder);
}
#endif

}  // namespace tandem::detail
