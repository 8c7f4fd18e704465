#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <tandem/solvers/linear/block_symbolic.hpp>
#include <tandem/solvers/linear/constrained_front.hpp>
#include <tandem/solvers/linear/selected_inverse.hpp>

namespace tandem::detail {
namespace {

using Part = Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

constexpr double kRounding = 1e-16, kAccuracy = 1e-8;  // relative error of an entry of S, and of a propagated variance

/// X = X L⁻¹ for X of m × n.
void solve_right(int m, int n, double* X, int ldx, const double* L, int ldl) {
  for (int c = n - 1; c >= 0; --c) {
    double* __restrict x = X + std::ptrdiff_t(c) * ldx;
    const double inverse = 1.0 / L[c + std::ptrdiff_t(c) * ldl];
    for (int i = 0; i < m; ++i) x[i] *= inverse;
    for (int p = 0; p < c; ++p) {
      const double factor = L[c + std::ptrdiff_t(p) * ldl];
      double* __restrict to = X + std::ptrdiff_t(p) * ldx;
      for (int i = 0; i < m; ++i) to[i] -= factor * x[i];
    }
  }
}

/// Y = S T for symmetric S of h × h, and T and Y of h × n.
void multiply(int h, int n, const double* S, const double* T, int ldt, double* Y, int ldy) {
  for (int c = 0; c < n; ++c) {
    double* __restrict y = Y + std::ptrdiff_t(c) * ldy;
    const double* t = T + std::ptrdiff_t(c) * ldt;
    std::fill_n(y, h, 0.0);
    int j = 0;
    for (; j + 3 < h; j += 4) {  // four columns per sweep save loads and stores of y
      const double* s = S + std::ptrdiff_t(j) * h;
      const double a = t[j], b = t[j + 1], p = t[j + 2], q = t[j + 3];
      for (int i = 0; i < h; ++i) y[i] += s[i] * a + s[i + h] * b + s[i + 2 * h] * p + s[i + 3 * h] * q;
    }
    for (; j < h; ++j)
      for (int i = 0; i < h; ++i) y[i] += S[i + std::ptrdiff_t(j) * h] * t[j];
  }
}

}  // namespace

SelectedInverse::SelectedInverse(const SymmetricPattern& pattern, std::span<const std::pair<int, int>> pairs)
    : BlockCholesky(pattern, pairs.empty() ? pattern : blocks_with(pattern, pairs)) {
  place_of_unknown_.resize(std::size_t(n_));
  place_.resize(std::size_t(blocks_));
  for (int k = 0; k < blocks_; ++k)
    for (int i = 0; i < size_[std::size_t(k)]; ++i)
      place_of_unknown_[std::size_t(first_unknown_[std::size_t(k)] + i)] = k;
  int tallest = 0, widest = 0;
  for (int b = 0; b < blocks_; ++b) {
    const int k = place_of_unknown_[std::size_t(pattern.first[std::size_t(b)])];
    place_[std::size_t(b)] = k;
    tallest = std::max(tallest, below(k));
    widest = std::max(widest, size_[std::size_t(k)]);
  }
  inverse_.resize(panel_.back());
  S_ss_.resize(Eigen::Index(tallest) * tallest);
  identity_.resize(Eigen::Index(widest) * widest);
}

int SelectedInverse::panel_row(int k, int row_block) const {
  int row = 0;
  for (int b = row_start_[std::size_t(k)]; b < row_start_[std::size_t(k) + 1]; ++b) {
    if (row_block_[std::size_t(b)] == row_block) return row;
    row += size_[std::size_t(row_block_[std::size_t(b)])];
  }
  return -1;
}

/// Scales each equation to norm 1 and assigns it to the first of its blocks in elimination order.
void SelectedInverse::distribute_equations(const LinearEquations& equations) {
  equations_.assign(std::size_t(blocks_), {});
  std::vector<int> place(std::size_t(equations.num_rows), blocks_), at(std::size_t(equations.num_rows));
  std::vector<int> waiting(std::size_t(blocks_), 0);
  for (std::size_t e = 0; e < equations.row.size(); ++e) {
    int& first = place[std::size_t(equations.row[e])];
    first = std::min(first, place_of_unknown_[std::size_t(equations.column[e])]);
  }
  for (std::size_t r = 0; r < place.size(); ++r)
    if (place[r] < blocks_) at[r] = waiting[std::size_t(place[r])]++;
  for (std::size_t k = 0; k < waiting.size(); ++k)
    if (waiting[k] > 0) equations_[k].setZero(waiting[k], panel_rows_[k]);

  std::vector<int> entry(place_of_unknown_.size());  // index of each unknown in its block
  for (int k = 0; k < blocks_; ++k)
    for (int i = 0; i < size_[std::size_t(k)]; ++i) entry[std::size_t(first_unknown_[std::size_t(k)] + i)] = i;
  for (std::size_t e = 0; e < equations.row.size(); ++e) {
    const std::size_t row = std::size_t(equations.row[e]), column = std::size_t(equations.column[e]);
    equations_[std::size_t(place[row])](at[row], panel_row(place[row], place_of_unknown_[column]) + entry[column]) +=
        equations.value[e];
  }
  for (auto& waiting_rows : equations_)
    for (Eigen::Index i = 0; i < waiting_rows.rows(); ++i) waiting_rows.row(i).stableNormalize();
}

bool SelectedInverse::compute(const Eigen::VectorXd& hessian, const LinearEquations& equations,
                              const std::function<void()>& check) {
  failed_ = -1;
  smallest_pivot_ = 1;
  log_determinant_ = 0;
  load(hessian);
  distribute_equations(equations);
  for (int k = 0; k < blocks_; ++k) {
    if (check) check();
    if (!(equations_[std::size_t(k)].rows() > 0 ? eliminate_constrained(k) : eliminate_free(k))) return false;
  }
  for (int k = blocks_ - 1; k >= 0; --k) {
    if (check) check();
    invert(k);
  }
  return true;
}

bool SelectedInverse::eliminate_free(int k) {
  failed_ = eliminate(k, k + 1, blocks_);
  if (failed_ >= 0) return false;
  const double* P = panel(k);
  for (int c = 0; c < size_[std::size_t(k)]; ++c) {
    const double pivot = P[c + std::ptrdiff_t(c) * panel_rows_[std::size_t(k)]];
    const double ratio = pivot * pivot / diagonal_[first_unknown_[std::size_t(k)] + c];
    smallest_pivot_ = ratio < smallest_pivot_ ? ratio : smallest_pivot_;
  }
  convert_factor(k);
  return true;
}

void SelectedInverse::convert_factor(int k) {
  const int n = size_[std::size_t(k)], m = panel_rows_[std::size_t(k)];
  double* P = panel(k);
  double* I = identity_.data();
  for (int c = 0; c < n; ++c) {
    for (int i = 0; i < n; ++i) I[i + c * n] = i == c;
    const double pivot = P[c + std::ptrdiff_t(c) * m];
    log_determinant_ += 2 * std::log(pivot);
    for (int i = n; i < m; ++i) P[i + std::ptrdiff_t(c) * m] = -P[i + std::ptrdiff_t(c) * m];
  }
  solve_right(m - n, n, P + n, m, P, m);
  solve_right(n, n, I, n, P, m);
  for (int c = 0; c < n; ++c)
    for (int i = 0; i <= c; ++i) {
      double sum = 0;
      for (int p = c; p < n; ++p) sum += I[p + i * n] * I[p + c * n];
      P[i + std::ptrdiff_t(c) * m] = P[c + std::ptrdiff_t(i) * m] = sum;
    }
}

bool SelectedInverse::eliminate_constrained(int k) {
  const int n = size_[std::size_t(k)], m = panel_rows_[std::size_t(k)], start = first_unknown_[std::size_t(k)];
  Part P(panel(k), m, n, Eigen::OuterStride<>(m));
  const ConstrainedFront front(P, std::exchange(equations_[std::size_t(k)], {}));
  const auto scale = diagonal_.segment(start, n);
  for (Eigen::Index i = 0; i < front.pivots.size(); ++i) {
    const auto direction = front.directions.col(i);
    if (!front.positive && !(front.pivots[i] > 0)) return fail(k, direction);
    smallest_pivot_ = std::min(smallest_pivot_, front.pivots[i] / direction.cwiseAbs2().dot(scale));
  }
  if (!front.positive) return fail(k, front.directions.rightCols<1>());
  log_determinant_ += front.pivots.array().log().sum();
  subtract_below(k, static_cast<int>(front.A.cols()), front.A.data(), front.B.data());
  P << front.D, front.Tt;
  if (m == n) return true;

  const Update& parent = updates_[std::size_t(update_start_[std::size_t(k)])];
  const std::size_t p = std::size_t(row_block_[std::size_t(row_start_[std::size_t(k)]) + 1]);
  Eigen::MatrixXd& waiting = equations_[p];
  const Eigen::Index before = waiting.rows();
  if (front.remaining.rows() > 0) {
    waiting.conservativeResize(before + front.remaining.rows(), panel_rows_[p]);
    waiting.bottomRows(front.remaining.rows()).setZero();
  }
  for (int r = parent.run_begin; r < parent.run_end && front.remaining.rows() > 0; ++r) {
    const Run& run = runs_[std::size_t(r)];
    waiting.bottomRows(front.remaining.rows()).middleCols(run.target - panel_[p], run.rows) =
        front.remaining.middleCols(run.source_row - n, run.rows);
  }
  // Reference values for weak pivots: only sums, without cancellation.
  for (int b = row_start_[std::size_t(k)] + 1, row = 0; b < row_start_[std::size_t(k) + 1]; ++b) {
    const std::size_t later = std::size_t(row_block_[std::size_t(b)]);
    diagonal_.segment(first_unknown_[later], size_[later]) += front.added.segment(row, size_[later]);
    row += size_[later];
  }
  return true;
}

bool SelectedInverse::fail(int k, const Eigen::VectorXd& direction) {
  Eigen::Index largest = 0;
  direction.cwiseAbs().maxCoeff(&largest);
  failed_ = static_cast<int>(first_unknown_[std::size_t(k)] + largest);
  return false;
}

void SelectedInverse::invert(int k) {
  const int n = size_[std::size_t(k)], m = panel_rows_[std::size_t(k)], h = m - n;
  // S_ss, gathered in the order of the updates.
  for (int u = update_start_[std::size_t(k)]; u < update_start_[std::size_t(k) + 1]; ++u) {
    const Update& update = updates_[std::size_t(u)];
    const int column = update.first_row - n;
    for (int r = update.run_begin; r < update.run_end; ++r) {
      const Run& run = runs_[std::size_t(r)];
      const int row = run.source_row - n;
      for (int j = 0; j < update.columns; ++j) {
        const double* from = inverse_.data() + run.target + std::ptrdiff_t(j) * update.target_stride;
        double* down = S_ss_.data() + row + std::ptrdiff_t(column + j) * h;
        double* across = S_ss_.data() + column + j + std::ptrdiff_t(row) * h;
        for (int i = 0; i < run.rows; ++i) down[i] = across[std::ptrdiff_t(i) * h] = from[i];
      }
    }
  }
  const double* P = panel(k);
  double* S = inverse_.data() + panel_[std::size_t(k)];
  multiply(h, n, S_ss_.data(), P + n, m, S + n, m);
  for (int c = 0; c < n; ++c)
    for (int i = 0; i <= c; ++i) {
      double sum = P[i + std::ptrdiff_t(c) * m];
      for (int p = n; p < m; ++p) sum += P[p + std::ptrdiff_t(i) * m] * S[p + std::ptrdiff_t(c) * m];
      S[i + std::ptrdiff_t(c) * m] = S[c + std::ptrdiff_t(i) * m] = sum;
    }
}

double SelectedInverse::trace_of_product() const {
  double sum = 0;
  for (int k = 0; k < blocks_; ++k)
    for (int i = 0; i < size_[std::size_t(k)]; ++i)
      sum += inverse_[panel_[std::size_t(k)] + std::ptrdiff_t(i) * (panel_rows_[std::size_t(k)] + 1)] *
             diagonal_[first_unknown_[std::size_t(k)] + i];
  return sum;
}

bool SelectedInverse::in_pattern(int a, int b) const {
  const auto [low, high] = std::minmax(place_[std::size_t(a)], place_[std::size_t(b)]);
  return panel_row(low, high) >= 0;
}

SelectedInverse::ConstPart SelectedInverse::stored(int low, int high) const {
  return {inverse_.data() + panel_[std::size_t(low)] + panel_row(low, high), size_[std::size_t(high)],
          size_[std::size_t(low)], Eigen::OuterStride<>(panel_rows_[std::size_t(low)])};
}

void SelectedInverse::block(int a, int b, Eigen::Ref<Eigen::MatrixXd> S) const {
  const int p = place_[std::size_t(a)], q = place_[std::size_t(b)];
  const int low = std::min(p, q), high = std::max(p, q);
  if (panel_row(low, high) >= 0) {
    const ConstPart held = stored(low, high);
    if (p >= q) {
      S = held;
    } else {
      S = held.transpose();
    }
    return;
  }
  Eigen::VectorXd x(n_);
  for (int c = 0; c < size_[std::size_t(high)]; ++c) {
    x.setZero();
    x[first_unknown_[std::size_t(high)] + c] = 1;
    solve_column(high, low, x);
    const auto part = x.segment(first_unknown_[std::size_t(low)], size_[std::size_t(low)]);
    if (p == low) {
      S.col(c) = part;
    } else {
      S.row(c) = part.transpose();
    }
  }
}

/// With y = (I − T)⁻ᵀ Jᵀ, J S Jᵀ is the sum of yᵀ D y over the eliminated places and of yᵀ S y over those that wait.
/// Eliminates places, from the first block towards the root, until the terms of yᵀ S y do not cancel.
Eigen::MatrixXd SelectedInverse::propagated(std::span<const int> blocks, const Eigen::MatrixXd& J) const {
  std::map<int, Eigen::MatrixXd> waiting;  // yᵀ of the places that wait; all pairs of them are in the pattern
  Eigen::Index column = 0;
  for (const int b : blocks) {
    const int place = place_[std::size_t(b)], width = size_[std::size_t(place)];
    waiting.try_emplace(place, Eigen::MatrixXd::Zero(J.rows(), width)).first->second += J.middleCols(column, width);
    column += width;
  }
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(J.rows(), J.rows());
  while (!waiting.empty()) {
    Eigen::Index width = 0;
    for (const auto& [place, y] : waiting) width += y.cols();
    Eigen::MatrixXd Y(J.rows(), width), S(width, width);
    Eigen::Index first = 0;
    for (const auto& [p, y] : waiting) {
      Y.middleCols(first, y.cols()) = y;
      Eigen::Index later = first;
      for (auto at = waiting.find(p); at != waiting.end(); later += at->second.cols(), ++at) {
        S.block(later, first, at->second.cols(), y.cols()) = stored(p, at->first);
        S.block(first, later, y.cols(), at->second.cols()) = stored(p, at->first).transpose();
      }
      first += y.cols();
    }
    const Eigen::MatrixXd all = sum + Y * S * Y.transpose();
    const Eigen::VectorXd terms = (Y.cwiseAbs() * S.cwiseAbs()).cwiseProduct(Y.cwiseAbs()).rowwise().sum();
    if ((kRounding * terms.array() <= kAccuracy * all.diagonal().array()).all()) return all;
    const auto eliminated = waiting.extract(waiting.begin());
    const int k = eliminated.key();
    const Eigen::MatrixXd& y = eliminated.mapped();
    const Eigen::OuterStride<> stride(panel_rows_[std::size_t(k)]);
    sum += y * ConstPart(panel(k), y.cols(), y.cols(), stride) * y.transpose();
    for (int b = row_start_[std::size_t(k)] + 1, row = size_[std::size_t(k)]; b < row_start_[std::size_t(k) + 1]; ++b) {
      const int place = row_block_[std::size_t(b)], rows = size_[std::size_t(place)];
      waiting.try_emplace(place, Eigen::MatrixXd::Zero(J.rows(), rows)).first->second +=
          y * ConstPart(panel(k) + row, rows, y.cols(), stride).transpose();
      row += rows;
    }
  }
  return sum;
}

/// x = S x = (I − T)⁻¹ D (I − T)⁻ᵀ x, where x is zero before the place `from`. Computes the result down to the place
/// `to`.
void SelectedInverse::solve_column(int from, int to, Eigen::VectorXd& x) const {
  const auto each_row = [&](int k, auto f) {
    for (int b = row_start_[std::size_t(k)] + 1, row = size_[std::size_t(k)]; b < row_start_[std::size_t(k) + 1]; ++b) {
      const std::size_t r = std::size_t(row_block_[std::size_t(b)]);
      f(ConstPart(panel(k) + row, size_[r], size_[std::size_t(k)], Eigen::OuterStride<>(panel_rows_[std::size_t(k)])),
        x.segment(first_unknown_[r], size_[r]));
      row += size_[r];
    }
  };
  const auto of = [&](int k) { return x.segment(first_unknown_[std::size_t(k)], size_[std::size_t(k)]); };
  for (int k = from; k < blocks_; ++k)
    each_row(k, [&](const ConstPart& Tt, auto later) { later.noalias() += Tt.lazyProduct(of(k)); });
  for (int k = blocks_ - 1; k >= to; --k) {
    auto xk = of(k);
    const int n = size_[std::size_t(k)];
    const ConstPart D(panel(k), n, n, Eigen::OuterStride<>(panel_rows_[std::size_t(k)]));
    if (k >= from) xk = D.lazyProduct(xk).eval();
    each_row(k, [&](const ConstPart& Tt, auto later) { xk.noalias() += Tt.transpose().lazyProduct(later); });
  }
}

}  // namespace tandem::detail
