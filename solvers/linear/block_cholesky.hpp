#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include <tandem/problem/function_ref.hpp>
#include <tandem/problem/program.hpp>

namespace tandem {

/// Sparse Cholesky H = L Lᵀ by blocks of one variable each, on the pattern of a Program's Hessian: symbolic analysis
/// once, then any number of numeric factorisations, which do not allocate after the first. The order is the variables' own where that
/// costs little more (a chain that keeps each keyframe's variables together is narrow-banded; a long one is eliminated from
/// both ends towards its middle, by two threads where there are), else SuiteSparse's AMD.
///
/// Why not CHOLMOD: its supernodal kernel is GPL, its simplicial one works entry by entry; dense kernels over the
/// blocks that the problem has anyway are faster (docs/results.md) and free of both.
class BlockCholesky {
 public:
  static constexpr double kALittleMore = 1.2;
  /// `natural_flops`: how many times the arithmetic of AMD's order the variables' own may take. It walks through memory as the
  /// problem lies there, which is worth a little more; and where what comes last is what inverse_of() is asked for, of which
  /// it is next to the root, a lot: with more than a little, a chain is eliminated from its beginning to its end. A pattern
  /// that is in_order_of_elimination() has its order.
  explicit BlockCholesky(const SymmetricPattern& pattern, double natural_flops = kALittleMore);
  BlockCholesky(BlockCholesky&&) = default;
  BlockCholesky& operator=(BlockCholesky&&) = default;

  /// Takes these threads from now on; they outlive the factor. What comes out is the same without.
  void use(const detail::Lanes& lanes) { lanes_ = &lanes; }

  /// Factorises H + diag(shift); `shift` may be empty. False when a pivot is not positive: see failed_unknown().
  bool factorize(const Eigen::VectorXd& values, const Eigen::VectorXd& shift = {});
  /// The same of H alone; of a pattern that is in_order_of_elimination() the factor takes the values' place, where solves read
  /// it: they are to stay as they are until the next factorisation.
  bool factorize_in_place(Eigen::VectorXd& values);
  /// x = (L Lᵀ)⁻¹ x. Solves do not allocate, and any number of threads may share a factor.
  void solve(Eigen::VectorXd& x) const;
  /// x = Lᵀ⁻¹ x and x = L⁻¹ x, up to the permutation of unknowns: maps white coordinates to tangent ones, and gradients
  /// in tangent coordinates to white ones.
  void solve_transposed(Eigen::VectorXd& x) const { backward(x); }
  void solve_lower(Eigen::VectorXd& x) const { forward(x); }
  /// Rows and columns of (L Lᵀ)⁻¹ that belong to these blocks of the pattern, in the order given. A solve for each
  /// column, through the blocks that one of these is eliminated before, in the tree of elimination.
  Eigen::MatrixXd inverse_of(const std::vector<int>& blocks) const;

  /// Unknown at which the last factorisation failed.
  int failed_unknown() const { return failed_; }
  /// Entries of L.
  double nonzeros() const { return nonzeros_; }

  /// A basis of the directions v with H v ≈ 0, at most `most` of them: pivots below `relative` times the diagonal
  /// entry they started from. Destroys the factor, and values that it can take the place of.
  std::vector<Eigen::VectorXd> null_space(Eigen::VectorXd& values, double relative, int most);

 protected:  // for detail::SelectedInverse, which eliminates on the same structure
  /// The factor has room for all of `blocks`, among which are those of the pattern.
  BlockCholesky(const SymmetricPattern& pattern, const SymmetricPattern& blocks);

  struct Copy {  // a block of H, or several one below the other, into a panel
    int source, source_stride, target, target_stride, rows, columns;
    bool transposed;
  };
  struct Fill {  // what of a panel H has no block for
    int target, stride, rows, columns;
  };
  struct Below {  // consecutive rows of a panel below its top, and their unknowns
    int row, unknown, rows;
  };
  struct Run {  // consecutive rows of an update: source row in the panel, target entry, number of rows
    int source_row, target, rows;
  };
  struct Update {  // panel of a block column onto that of one of its rows
    int first_row, columns, target_stride, run_begin, run_end;
  };

  void compile(const SymmetricPattern& pattern, const SymmetricPattern& blocks, double natural_flops);
  void compile(const SymmetricPattern& factor);
  void compile_loading(const SymmetricPattern& pattern, const SymmetricPattern& factor);
  void compile_rows(const std::vector<int>& row_in_panel);
  void compile_updates(const std::vector<int>& row_in_panel);
  /// Consecutive block columns in the order of elimination, and what is loaded into their panels.
  struct Section {
    int begin = 0, end = 0;
    std::vector<Copy> copies;
    std::vector<Fill> fill;
  };
  struct WeakPivots {  // not above `relative` times their diagonal entry
    double relative;
    std::vector<int> unknowns;
  };

  /// f(0) and f(1), of the two parts that do not touch, at once where there are threads.
  void for_both(detail::FunctionRef<void(int part)> f) const;
  void take_own_memory();
  void load(const Eigen::VectorXd& values);
  /// With `weak`, those of the first, second and third part are noted there.
  bool factorize(const Eigen::VectorXd& values, const Eigen::VectorXd& shift, WeakPivots* weak);
  void load(const Section& part, const Eigen::VectorXd& values, const Eigen::VectorXd& shift, bool with_diagonal);
  /// Block columns of what is loaded, in the order of elimination, and what they change of those to come before `reach`. Weak
  /// pivots are noted, where they are asked for, and replaced by one, their column cut off. The unknown at which it
  /// failed, or −1.
  int eliminate(int begin, int end, int reach, WeakPivots* weak = nullptr);
  /// Subtracts A Bᵀ from the columns of the panel's block rows below its top. A and B have the panel's rows (those of
  /// its top are not read) and `inner` columns.
  void subtract_below(int k, int inner, const double* A, const double* B);
  // Both in the pattern's order of unknowns, in place: each block's are consecutive there too.
  void forward(Eigen::VectorXd& y) const;
  void backward(Eigen::VectorXd& y) const;
  std::vector<int> ancestry_of(const std::vector<int>& blocks) const;

  // Of block column k alone, for at_best().
  [[gnu::always_inline]] void subtract_updates(int begin, int end, int k, int inner, const double* A, const double* B);
  /// The first of its updates, or their end, that is of a block column from `reach` on.
  [[gnu::always_inline]] int first_update(int k, int reach) const;
  [[gnu::always_inline]] void forward_by(int k, double* y) const;
  [[gnu::always_inline]] void forward_top(int k, double* y) const;
  [[gnu::always_inline]] void forward_below(int begin, int end, int k, double* y) const;
  [[gnu::always_inline]] void backward_by(int k, double* y) const;

  int n_ = 0, blocks_ = 0, failed_ = -1;
  double nonzeros_ = 0;
  std::vector<int> size_;                   // of each block column, in elimination order
  std::vector<int> row_start_, row_block_;  // block rows of each block column, itself first
  std::vector<int> panel_rows_;             // height of each panel
  std::vector<int> panel_;                  // first entry of each panel, column-major, and their end
  std::vector<int> first_unknown_;          // of each block column
  std::vector<int> place_of_block_;         // of each block of the pattern
  // Two that do not touch, each before what both are below of; or none and all.
  std::array<Section, 3> parts_;
  std::vector<int> joints_;       // block columns of the first two with rows in the third
  std::vector<int> below_start_;  // of each block column
  std::vector<int> below_joint_;  // the first, or the end, of those in the third part
  std::vector<Below> below_;
  std::vector<int> update_start_;
  std::vector<Update> updates_;
  std::vector<Run> runs_;
  bool laid_out_ = true;  // the pattern's values stand as the factor's entries do
  Eigen::VectorXd values_;
  double* entries_ = nullptr;  // those, or the values of factorize_in_place()
  Eigen::VectorXd diagonal_;   // of each unknown what its pivot started from, where that may be weak
  const detail::Lanes* lanes_ = nullptr;
};

/// The pattern in which values stand where the factor's entries do, by BlockCholesky's order: for Programs whose Hessian is
/// to be factorised in its place. Throws Error where the factor has more than 2^31 entries.
SymmetricPattern in_order_of_elimination(const SymmetricPattern& pattern);

}  // namespace tandem
