#include <algorithm>

#include <tandem/lie/error.hpp>
#include <tandem/problem/prefault.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>
#include <tandem/solvers/linear/block_symbolic.hpp>
#include <tandem/solvers/linear/panel_kernels.hpp>

namespace tandem {
SymmetricPattern in_elimination_order(const SymmetricPattern& pattern) {
  return detail::in_elimination_order(pattern, detail::analyze(pattern, BlockCholesky::kDefaultNaturalFlops, true));
}

BlockCholesky::BlockCholesky(const SymmetricPattern& pattern, double natural_flops) {
  if (pattern.place.empty())
    compile(pattern, pattern, natural_flops);
  else
    compile(pattern);
}
BlockCholesky::BlockCholesky(const SymmetricPattern& pattern, const SymmetricPattern& blocks) {
  compile(pattern, blocks, kDefaultNaturalFlops);
}

void BlockCholesky::compile(const SymmetricPattern& pattern, const SymmetricPattern& blocks, double natural_flops) {
  const SymmetricPattern factor = detail::in_elimination_order(
      pattern, detail::analyze(blocks, natural_flops, natural_flops <= kDefaultNaturalFlops));
  compile(factor);
  in_factor_order_ = false;
  use_own_memory();
  compile_copies(pattern, factor);
}

void BlockCholesky::compile(const SymmetricPattern& factor) {
  n_ = factor.size();
  blocks_ = factor.num_blocks();
  place_of_block_ = factor.place;
  parts_[0].end = parts_[1].begin = factor.first_part;
  parts_[1].end = parts_[2].begin = factor.second_part;
  parts_[2].end = blocks_;
  diagonal_.resize(n_);

  std::vector<int> order(factor.place.size());
  for (std::size_t block = 0; block < order.size(); ++block)
    order[std::size_t(factor.place[block])] = static_cast<int>(block);
  for (auto* of_blocks : {&size_, &panel_rows_, &first_unknown_}) of_blocks->reserve(order.size());
  for (auto* of_ends : {&panel_, &row_start_, &below_start_, &below_separator_, &update_start_})
    of_ends->reserve(order.size() + 1);
  row_block_.reserve(factor.block_row.size());
  std::vector<int> row_in_panel;
  row_in_panel.reserve(factor.block_row.size());
  row_start_.push_back(0);
  for (const int block : order) {
    const int width = factor.width(block), height = factor.height(block);
    size_.push_back(width);
    panel_rows_.push_back(height);
    panel_.push_back(factor.value_start[std::size_t(block)]);
    first_unknown_.push_back(factor.first[std::size_t(block)]);
    for (int b = factor.block_start[std::size_t(block)]; b < factor.block_start[std::size_t(block) + 1]; ++b) {
      row_block_.push_back(factor.place[std::size_t(factor.block_row[std::size_t(b)])]);
      row_in_panel.push_back(factor.block_offset[std::size_t(b)]);
    }
    row_start_.push_back(static_cast<int>(row_block_.size()));
    nonzeros_ += 0.5 * width * (width + 1) + double(width) * (height - width);
  }

  panel_.push_back(factor.value_start.back());
  const std::size_t below_tops = row_block_.size() - std::size_t(blocks_);
  below_.reserve(below_tops);
  updates_.reserve(below_tops);
  runs_.reserve(below_tops);
  detail::prefault(below_, below_tops);
  detail::prefault(updates_, below_tops);
  detail::prefault(runs_, below_tops);
  compile_rows(row_in_panel);
  compile_updates(row_in_panel);
}

/// Lists the copies of blocks of H into panels, and the parts of panels that are fill.
void BlockCholesky::compile_copies(const SymmetricPattern& pattern, const SymmetricPattern& factor) {
  const auto part_of = [&](int k) -> Section& {
    return parts_[k < factor.first_part ? 0 : k < factor.second_part ? 1 : 2];
  };
  std::vector<char> is_fill(factor.block_row.size(), 1);
  for (int block = 0; block < blocks_; ++block) {
    const int columns = pattern.width(block), stride = pattern.height(block),
              place = place_of_block_[std::size_t(block)];
    for (int b = pattern.block_start[std::size_t(block)]; b < pattern.block_start[std::size_t(block) + 1]; ++b) {
      const int other = pattern.block_row[std::size_t(b)], place_of_other = place_of_block_[std::size_t(other)];
      const SymmetricPattern::BlockPlace to = factor.find(other, block);
      is_fill[std::size_t(to.entry)] = 0;
      const Copy copy{pattern.value_start[std::size_t(block)] + pattern.block_offset[std::size_t(b)],
                      stride,
                      to.first_value,
                      to.stride,
                      pattern.width(other),
                      columns,
                      to.transposed};
      std::vector<Copy>& copies = part_of(std::min(place, place_of_other)).copies;
      const bool goes_on = !copies.empty() && !copy.transposed && !copies.back().transposed &&
                           copies.back().target + copies.back().rows == copy.target &&
                           copies.back().source + copies.back().rows == copy.source;
      if (goes_on && copies.back().columns == columns) {
        copies.back().rows += copy.rows;
      } else {
        copies.push_back(copy);
      }
    }
  }
  for (int block = 0; block < blocks_; ++block)
    for (int b = factor.block_start[std::size_t(block)]; b < factor.block_start[std::size_t(block) + 1]; ++b)
      if (is_fill[std::size_t(b)])
        part_of(place_of_block_[std::size_t(block)])
            .fill.push_back({factor.value_start[std::size_t(block)] + factor.block_offset[std::size_t(b)],
                             factor.height(block), factor.width(factor.block_row[std::size_t(b)]),
                             factor.width(block)});
}

void BlockCholesky::compile_rows(const std::vector<int>& row_in_panel) {
  below_start_.push_back(0);
  for (int k = 0; k < blocks_; ++k) {
    const auto begin = std::size_t(row_start_[std::size_t(k)]), end = std::size_t(row_start_[std::size_t(k) + 1]);
    const int reach = k < parts_[2].begin ? parts_[2].begin : blocks_;
    int separator = -1;
    for (std::size_t b = begin; b < end; ++b) {
      const int rows = size_[std::size_t(row_block_[b])], row = row_in_panel[b];
      if (b == begin) continue;
      const bool is_separator = separator < 0 && row_block_[b] >= reach;
      if (is_separator) separator = static_cast<int>(below_.size());
      const int unknown = first_unknown_[std::size_t(row_block_[b])];
      if (b > begin + 1 && !is_separator && below_.back().unknown + below_.back().rows == unknown) {
        below_.back().rows += rows;
      } else {
        below_.push_back({row, unknown, rows});
      }
    }
    below_start_.push_back(static_cast<int>(below_.size()));
    below_separator_.push_back(separator < 0 ? below_start_.back() : separator);
    if (separator >= 0) separator_columns_.push_back(k);
  }
}

void BlockCholesky::compile_updates(const std::vector<int>& row_in_panel) {
  const auto row_of = [&](int k, int r) {  // first row of block row r in the panel of k
    const auto begin = row_block_.begin() + row_start_[std::size_t(k)],
               end = row_block_.begin() + row_start_[std::size_t(k) + 1];
    return row_in_panel[std::size_t(std::lower_bound(begin, end, r) - row_block_.begin())];
  };
  update_start_.push_back(0);
  for (int k = 0; k < blocks_; ++k) {
    const int begin = row_start_[std::size_t(k)], end = row_start_[std::size_t(k) + 1];
    for (int b = begin + 1; b < end; ++b) {
      const int target = row_block_[std::size_t(b)];
      Update u{row_in_panel[std::size_t(b)], size_[std::size_t(target)], panel_rows_[std::size_t(target)],
               static_cast<int>(runs_.size()), 0};
      for (int a = b; a < end; ++a) {
        const int to = panel_[std::size_t(target)] + row_of(target, row_block_[std::size_t(a)]);
        const int rows = size_[std::size_t(row_block_[std::size_t(a)])];
        if (static_cast<int>(runs_.size()) > u.run_begin && runs_.back().target + runs_.back().rows == to) {
          runs_.back().rows += rows;
        } else {
          runs_.push_back({row_in_panel[std::size_t(a)], to, rows});
        }
      }
      u.run_end = static_cast<int>(runs_.size());
      updates_.push_back(u);
    }
    update_start_.push_back(static_cast<int>(updates_.size()));
  }
}

void BlockCholesky::for_both_halves(detail::FunctionRef<void(int part)> f) const {
  if (parts_[1].end == 0) return;
  if (task_runner_ && nonzeros_ >= detail::kMinEntriesForThreads) return task_runner_->run(2, f);
  f(0);
  f(1);
}

void BlockCholesky::load(const Eigen::VectorXd& values) {
  for (const Section& part : parts_) load(part, values, {}, true);
}

/// Loads the values of H into a part of the factor. Copies nothing if the values are the memory of the factor.
void BlockCholesky::load(const Section& part, const Eigen::VectorXd& values, const Eigen::VectorXd& shift,
                         bool with_diagonal) {
  if (part.begin == part.end) return;
  if (in_factor_order_ && values.data() != entries_) {
    const int first = panel_[std::size_t(part.begin)];
    std::copy_n(values.data() + first, panel_[std::size_t(part.end)] - first, entries_ + first);
  }
  if (!in_factor_order_)
    detail::dispatch_simd([&]() TANDEM_INLINED_HERE {
      for (const Fill& f : part.fill)
        for (int j = 0; j < f.columns; ++j) detail::set_zero(f.rows, entries_ + f.target + j * f.stride);
      for (const Copy& c : part.copies) {
        const double* from = values.data() + c.source;
        double* to = entries_ + c.target;
        for (int j = 0; j < c.columns; ++j, from += c.source_stride) {
          if (!c.transposed)
            detail::copy(c.rows, from, to + j * c.target_stride);
          else
            for (int i = 0; i < c.rows; ++i) to[j + i * c.target_stride] = from[i];
        }
      }
    });
  if (shift.size() == 0 && !with_diagonal) return;
  for (int k = part.begin; k < part.end; ++k) {
    double* panel = entries_ + panel_[std::size_t(k)];
    for (int i = 0, unknown = first_unknown_[std::size_t(k)]; i < size_[std::size_t(k)]; ++i, ++unknown) {
      double& d = panel[i * (panel_rows_[std::size_t(k)] + 1)];
      if (shift.size() > 0) d += shift[unknown];
      if (with_diagonal) diagonal_[unknown] = d;
    }
  }
}

int BlockCholesky::eliminate(int begin, int end, int reach, WeakPivots* weak) {
  return detail::dispatch_simd([&]() TANDEM_INLINED_HERE {
    double inverse[detail::kMaxDofs];
    int failed = 0;
    for (int k = begin; k < end; ++k) {
      const int n = size_[std::size_t(k)], m = panel_rows_[std::size_t(k)], first = first_unknown_[std::size_t(k)];
      double* P = entries_ + panel_[std::size_t(k)];
      const auto is_weak = [&](int c, double pivot) TANDEM_INLINED_HERE {
        if (!weak || pivot > weak->relative * diagonal_[first + c]) return false;
        weak->unknowns.push_back(first + c);
        return true;
      };
      const bool positive = n == 6   ? detail::factor_panel<6>(n, m, P, inverse, failed, is_weak)
                            : n == 3 ? detail::factor_panel<3>(n, m, P, inverse, failed, is_weak)
                                     : detail::factor_panel<0>(n, m, P, inverse, failed, is_weak);
      if (!positive) return first + failed;
      subtract_updates(update_start_[std::size_t(k)], first_update(k, reach), k, n, P, P);
    }
    return -1;
  });
}

inline int BlockCholesky::first_update(int k, int reach) const {  // there is one update per block row below the top
  int update = update_start_[std::size_t(k) + 1], row = row_start_[std::size_t(k) + 1];
  for (; update > update_start_[std::size_t(k)] && row_block_[std::size_t(row) - 1] >= reach; --row) --update;
  return update;
}

inline void BlockCholesky::subtract_updates(int begin, int end, int k, int inner, const double* A, const double* B) {
  const int m = panel_rows_[std::size_t(k)];
  for (int u = begin; u < end; ++u) {
    const Update& update = updates_[std::size_t(u)];
    for (int r = update.run_begin; r < update.run_end; ++r) {
      const Run& run = runs_[std::size_t(r)];
      detail::subtract_product_any(run.rows, update.columns, inner, entries_ + run.target, update.target_stride,
                                   A + run.source_row, m, B + update.first_row, m);
    }
  }
}

void BlockCholesky::subtract_below(int k, int inner, const double* A, const double* B) {
  detail::dispatch_simd([&]() TANDEM_INLINED_HERE {
    subtract_updates(update_start_[std::size_t(k)], update_start_[std::size_t(k) + 1], k, inner, A, B);
  });
}

bool BlockCholesky::factorize(const Eigen::VectorXd& values, const Eigen::VectorXd& shift) {
  use_own_memory();
  return factorize(values, shift, nullptr);
}

bool BlockCholesky::factorize_shifted(const Eigen::VectorXd& values, Eigen::VectorXd diagonal, double relative) {
  for (double& d : diagonal) d = d > 0 ? relative * d : 1.0;
  for (; diagonal.allFinite(); diagonal *= 10)
    if (factorize(values, diagonal)) return true;
  return false;
}

bool BlockCholesky::factorize_in_place(Eigen::VectorXd& values) {
  if (!in_factor_order_) return factorize(values);
  entries_ = values.data();
  return factorize(values, {}, nullptr);
}

void BlockCholesky::use_own_memory() {
  if (values_.size() == 0) {
    values_.resize(panel_.back());
    detail::prefault(values_, std::size_t(values_.size()));
  }
  entries_ = values_.data();
}

bool BlockCholesky::factorize(const Eigen::VectorXd& values, const Eigen::VectorXd& shift, WeakPivots* weak) {
  const int separator = parts_[2].begin;
  std::array<int, 2> failed{-1, -1};
  for_both_halves([&](int p) {
    const Section& section = parts_[std::size_t(p)];
    load(section, values, shift, weak != nullptr);
    failed[std::size_t(p)] = eliminate(section.begin, section.end, separator, weak ? &weak[p] : nullptr);
  });
  failed_ = failed[0] >= 0 ? failed[0] : failed[1];
  if (failed_ >= 0) return false;
  load(parts_[2], values, shift, weak != nullptr);
  // Both halves update the separator one after the other, so that sums do not depend on the number of threads.
  detail::dispatch_simd([&]() TANDEM_INLINED_HERE {
    for (const int k : separator_columns_) {
      const double* P = entries_ + panel_[std::size_t(k)];
      subtract_updates(first_update(k, separator), update_start_[std::size_t(k) + 1], k, size_[std::size_t(k)], P, P);
    }
  });
  failed_ = eliminate(separator, blocks_, blocks_, weak ? &weak[2] : nullptr);
  return failed_ < 0;
}

std::vector<Eigen::VectorXd> BlockCholesky::null_space(Eigen::VectorXd& values, double relative, int most,
                                                       std::vector<int>* unknowns) {
  if (in_factor_order_)
    entries_ = values.data();
  else
    use_own_memory();
  std::array<WeakPivots, 3> of_parts{{{relative, {}}, {relative, {}}, {relative, {}}}};
  factorize(values, {}, of_parts.data());
  std::vector<int> weak;
  for (const WeakPivots& part : of_parts) weak.insert(weak.end(), part.unknowns.begin(), part.unknowns.end());
  for (const int unknown : weak) diagonal_[unknown] = 0;
  std::vector<Eigen::VectorXd> basis;
  for (const int unknown : weak) {
    if (static_cast<int>(basis.size()) >= most) break;
    Eigen::VectorXd v = Eigen::VectorXd::Zero(n_);
    v[unknown] = 1;
    backward(v);
    basis.push_back(v.normalized());
  }
  if (unknowns) *unknowns = std::move(weak);
  return basis;
}

std::vector<int> BlockCholesky::small_pivots(double relative, int most) const {
  std::vector<std::pair<double, int>> small;
  for (int k = 0; k < blocks_; ++k)
    for (int i = 0; i < size_[std::size_t(k)]; ++i) {
      const double pivot = entries_[panel_[std::size_t(k)] + i * (panel_rows_[std::size_t(k)] + 1)];
      const int unknown = first_unknown_[std::size_t(k)] + i;
      if (pivot * pivot < relative * diagonal_[unknown])
        small.emplace_back(pivot * pivot / diagonal_[unknown], unknown);
    }
  std::sort(small.begin(), small.end());
  std::vector<int> unknowns;
  for (std::size_t i = 0; i < std::min(small.size(), std::size_t(most)); ++i) unknowns.push_back(small[i].second);
  return unknowns;
}

}  // namespace tandem
