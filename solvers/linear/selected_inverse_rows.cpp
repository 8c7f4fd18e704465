#include <cmath>

#include <Eigen/QR>

#include <tandem/solvers/linear/selected_inverse.hpp>

// Elimination of whitened rows by orthogonal transformations (multifrontal QR; Duff & Reid 1983, Davis 2011).
namespace tandem::detail {
namespace {

constexpr double kRelativeDiagonal = 1e-14;  // smallest pivot of R that is not rounding, relative to its column

}  // namespace

bool SelectedInverse::compute_from_rows(std::span<const WhitenedRows> rows, const std::function<void()>& check) {
  failed_ = -1;
  smallest_pivot_ = 1;
  log_determinant_ = decrease_ = 0;
  use_own_memory();
  minimizer_.setZero(n_);
  // Rows that wait for the elimination of each place: columns as in its panel, then the residual.
  std::vector<Eigen::MatrixXd> waiting{std::size_t(blocks_)};
  std::vector<int> first(rows.size(), blocks_);
  std::vector<Eigen::Index> count(std::size_t(blocks_), 0);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (const int b : rows[i].blocks) first[i] = std::min(first[i], place_[std::size_t(b)]);
    if (first[i] < blocks_) count[std::size_t(first[i])] += rows[i].J.rows();
  }
  for (std::size_t k = 0; k < waiting.size(); ++k) waiting[k].setZero(count[k], panel_rows_[k] + 1);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (first[i] == blocks_) continue;
    const WhitenedRows& from = rows[i];
    Eigen::MatrixXd& to = waiting[std::size_t(first[i])];
    const Eigen::Index n = from.J.rows(), at = count[std::size_t(first[i])] -= n;
    Eigen::Index column = 0;
    for (const int b : from.blocks) {
      const int place = place_[std::size_t(b)], width = size_[std::size_t(place)];
      to.block(at, panel_row(first[i], place), n, width) += from.J.middleCols(column, width);
      column += width;
    }
    to.col(to.cols() - 1).segment(at, n) = from.r;
  }
  for (int k = 0; k < blocks_; ++k) {
    if (check) check();
    if (!eliminate_rows(k, waiting)) return false;
  }
  for (int k = blocks_ - 1; k >= 0; --k) {
    if (check) check();
    for (int b = row_start_[std::size_t(k)] + 1, row = size_[std::size_t(k)]; b < row_start_[std::size_t(k) + 1]; ++b) {
      const auto later = std::size_t(row_block_[std::size_t(b)]);
      const Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>> Tt(
          panel(k) + row, size_[later], size_[std::size_t(k)], Eigen::OuterStride<>(panel_rows_[std::size_t(k)]));
      minimizer_.segment(first_unknown_[std::size_t(k)], size_[std::size_t(k)]) +=
          Tt.transpose() * minimizer_.segment(first_unknown_[later], size_[later]);
      row += size_[later];
    }
    invert(k);
  }
  return true;
}

/// Eliminates the unknowns of place k from the rows that wait for it, and passes the remaining rows to its parent.
bool SelectedInverse::eliminate_rows(int k, std::vector<Eigen::MatrixXd>& waiting) {
  const int n = size_[std::size_t(k)], m = panel_rows_[std::size_t(k)], unknown = first_unknown_[std::size_t(k)];
  Eigen::MatrixXd front = std::move(waiting[std::size_t(k)]);
  waiting[std::size_t(k)] = {};
  if (front.rows() < n) {
    failed_ = unknown + static_cast<int>(front.rows());
    return false;
  }
  const Eigen::VectorXd norms = front.leftCols(n).colwise().norm();
  const Eigen::HouseholderQR<Eigen::Ref<Eigen::MatrixXd>> qr(front);  // in place
  for (int c = 0; c < n; ++c) {
    if (!(std::abs(front(c, c)) > kRelativeDiagonal * norms[c])) {
      failed_ = unknown + c;
      return false;
    }
    if (front(c, c) < 0) front.row(c).tail(m + 1 - c) *= -1;
  }
  const auto R = front.topLeftCorner(n, n).triangularView<Eigen::Upper>();
  const Eigen::VectorXd y = front.col(m).head(n);
  decrease_ += 0.5 * y.squaredNorm();
  minimizer_.segment(unknown, n) = -R.solve(y);
  Eigen::Map<Eigen::MatrixXd> P(panel(k), m, n);
  P.topRows(n) = R.transpose().toDenseMatrix();
  P.bottomRows(m - n) = front.block(0, n, n, m - n).transpose();
  convert_factor(k);
  const Eigen::Index rest = std::min<Eigen::Index>(front.rows() - n, m - n);
  if (rest <= 0) return true;
  const Update& parent = updates_[std::size_t(update_start_[std::size_t(k)])];
  const auto p = std::size_t(row_block_[std::size_t(row_start_[std::size_t(k)]) + 1]);
  Eigen::MatrixXd& of_parent = waiting[p];
  const Eigen::Index before = of_parent.rows();
  of_parent.conservativeResize(before + rest, Eigen::NoChange);
  of_parent.bottomRows(rest).setZero();
  for (int r = parent.run_begin; r < parent.run_end; ++r) {
    const Run& run = runs_[std::size_t(r)];
    for (int c = 0; c < run.rows; ++c) {
      const Eigen::Index from = run.source_row + c, used = std::min<Eigen::Index>(rest, from - n + 1);
      of_parent.col(run.target - panel_[p] + c).segment(before, used) = front.col(from).segment(n, used);
    }
  }
  of_parent.col(of_parent.cols() - 1).segment(before, rest) = front.col(m).segment(n, rest);
  return true;
}

}  // namespace tandem::detail
