#include <algorithm>

#include <tandem/lie/error.hpp>
#include <tandem/problem/populate.hpp>
#include <tandem/solvers/linear/block_cholesky.hpp>
#include <tandem/solvers/linear/block_symbolic.hpp>
#include <tandem/solvers/linear/panel_kernels.hpp>

namespace tandem {
BlockCholesky::BlockCholesky(const SymmetricPattern& pattern, double natural_flops) {
  order_and_analyze(pattern, pattern, natural_flops);
}
BlockCholesky::BlockCholesky(const SymmetricPattern& pattern, const SymmetricPattern& structure) {
  order_and_analyze(pattern, structure, kALittleMore);
}

void BlockCholesky::order_and_analyze(const SymmetricPattern& pattern, const SymmetricPattern& structure,
                                      double natural_flops) {
  detail::BlockSymbolic s = detail::analyze(structure, natural_flops, natural_flops <= kALittleMore);
  n_ = pattern.size();
  blocks_ = pattern.num_blocks();
  nonzeros_ = s.nonzeros;
  row_start_ = std::move(s.row_start);
  row_block_ = std::move(s.row);
  parts_[0].end = parts_[1].begin = s.first_part;
  parts_[1].end = parts_[2].begin = s.second_part;
  parts_[2].end = blocks_;
  const auto part_of = [&](int k) -> Section& { return parts_[k < s.first_part ? 0 : k < s.second_part ? 1 : 2]; };

  std::vector<int>& place = place_of_block_;
  place.resize(s.order.size());
  start_.push_back(0);
  for (std::size_t k = 0; k < s.order.size(); ++k) {
    const std::size_t block = std::size_t(s.order[k]);
    place[block] = static_cast<int>(k);
    size_.push_back(pattern.first[block + 1] - pattern.first[block]);
    start_.push_back(start_.back() + size_.back());
    first_unknown_.push_back(pattern.first[block]);
    for (int u = pattern.first[block]; u < pattern.first[block + 1]; ++u) unknown_.push_back(u);
  }

  // Panels: block column k with its block rows stacked; first row of each within the panel.
  std::vector<int> row_in_panel(row_block_.size());
  double entries = 0;
  for (std::size_t k = 0; k < size_.size(); ++k) {
    int height = 0;
    for (int b = row_start_[k]; b < row_start_[k + 1]; ++b) {
      row_in_panel[std::size_t(b)] = height;
      height += size_[std::size_t(row_block_[std::size_t(b)])];
    }
    panel_rows_.push_back(height);
    panel_.push_back(static_cast<int>(entries));
    entries += double(height) * size_[k];
    if (entries > 2147483647.0) throw Error("the Cholesky factor would have more than 2^31 entries");
  }
  values_.resize(static_cast<Eigen::Index>(entries));
  detail::populate(values_, std::size_t(values_.size()));
  diagonal_.resize(n_);

  // Which of all block rows is r of block column k, and where it stands in the panel.
  const auto entry = [&](int k, int r) {
    const auto begin = row_block_.begin() + row_start_[std::size_t(k)],
               end = row_block_.begin() + row_start_[std::size_t(k) + 1];
    return std::size_t(std::lower_bound(begin, end, r) - row_block_.begin());
  };
  const auto find = [&](int k, int r) { return row_in_panel[entry(k, r)]; };
  std::vector<char> is_fill(row_block_.size(), 1);
  const std::size_t below_tops = row_block_.size() - std::size_t(blocks_);
  below_.reserve(below_tops);
  updates_.reserve(below_tops);
  runs_.reserve(below_tops);
  detail::populate(below_, below_tops);
  detail::populate(updates_, below_tops);
  detail::populate(runs_, below_tops);
  for (int block = 0; block < blocks_; ++block) {
    const int columns = pattern.first[std::size_t(block) + 1] - pattern.first[std::size_t(block)];
    const std::size_t column = std::size_t(pattern.first[std::size_t(block)]);
    int source = pattern.column_start[column];
    const int stride = pattern.column_start[column + 1] - source;
    for (int b = pattern.block_start[std::size_t(block)]; b < pattern.block_start[std::size_t(block) + 1]; ++b) {
      const int other = pattern.block_row[std::size_t(b)];
      const int rows = pattern.first[std::size_t(other) + 1] - pattern.first[std::size_t(other)];
      const int p = place[std::size_t(block)], q = place[std::size_t(other)];
      const int k = std::min(p, q), r = std::max(p, q);
      const std::size_t to = entry(k, r);
      is_fill[to] = 0;
      const Copy copy{source,  stride, panel_[std::size_t(k)] + row_in_panel[to], panel_rows_[std::size_t(k)], rows,
                      columns, p > q};
      std::vector<Copy>& copies = part_of(k).copies;
      const bool goes_on = !copies.empty() && !copy.transposed && !copies.back().transposed &&
                           copies.back().target + copies.back().rows == copy.target &&
                           copies.back().source + copies.back().rows == copy.source;
      if (goes_on && copies.back().columns == columns) {
        copies.back().rows += rows;
      } else {
        copies.push_back(copy);
      }
      source += rows;
    }
  }
  below_start_.push_back(0);
  for (int k = 0; k < blocks_; ++k) {
    const auto begin = std::size_t(row_start_[std::size_t(k)]), end = std::size_t(row_start_[std::size_t(k) + 1]);
    const int reach = k < s.second_part ? s.second_part : blocks_;
    int joint = -1;
    for (std::size_t b = begin; b < end; ++b) {
      const int rows = size_[std::size_t(row_block_[b])], row = row_in_panel[b];
      if (is_fill[b])
        part_of(k).fill.push_back(
            {panel_[std::size_t(k)] + row, panel_rows_[std::size_t(k)], rows, size_[std::size_t(k)]});
      if (b == begin) continue;
      const bool is_joint = joint < 0 && row_block_[b] >= reach;
      if (is_joint) joint = static_cast<int>(below_.size());
      const int unknown = first_unknown_[std::size_t(row_block_[b])];
      if (b > begin + 1 && !is_joint && below_.back().unknown + below_.back().rows == unknown) {
        below_.back().rows += rows;
      } else {
        below_.push_back({row, unknown, rows});
      }
    }
    below_start_.push_back(static_cast<int>(below_.size()));
    below_joint_.push_back(joint < 0 ? below_start_.back() : joint);
    if (joint >= 0) joints_.push_back(k);
  }

  update_start_.push_back(0);
  for (int k = 0; k < blocks_; ++k) {
    const int begin = row_start_[std::size_t(k)], end = row_start_[std::size_t(k) + 1];
    for (int b = begin + 1; b < end; ++b) {
      const int target = row_block_[std::size_t(b)];
      Update u{row_in_panel[std::size_t(b)], size_[std::size_t(target)], panel_rows_[std::size_t(target)],
               static_cast<int>(runs_.size()), 0};
      for (int a = b; a < end; ++a) {
        const int to = panel_[std::size_t(target)] + find(target, row_block_[std::size_t(a)]);
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

void BlockCholesky::for_both(detail::FunctionRef<void(int part)> f) const {
  if (parts_[1].end == 0) return;
  if (lanes_ && nonzeros_ >= detail::kWorthThreads) return lanes_->run(2, f);
  f(0);
  f(1);
}

void BlockCholesky::load(const Eigen::VectorXd& values, const Eigen::VectorXd& shift) {
  for (const Section& part : parts_) load(part, values, shift);
}

void BlockCholesky::load(const Section& part, const Eigen::VectorXd& values, const Eigen::VectorXd& shift) {
  detail::at_best([&]() TANDEM_INLINED_HERE {
    for (const Fill& f : part.fill)
      for (int j = 0; j < f.columns; ++j) detail::set_zero(f.rows, values_.data() + f.target + j * f.stride);
    for (const Copy& c : part.copies) {
      const double* from = values.data() + c.source;
      double* to = values_.data() + c.target;
      for (int j = 0; j < c.columns; ++j, from += c.source_stride) {
        if (!c.transposed)
          detail::copy(c.rows, from, to + j * c.target_stride);
        else
          for (int i = 0; i < c.rows; ++i) to[j + i * c.target_stride] = from[i];
      }
    }
  });
  for (int k = part.begin, place = start_[std::size_t(k)]; k < part.end; ++k) {
    double* panel = values_.data() + panel_[std::size_t(k)];
    for (int i = 0; i < size_[std::size_t(k)]; ++i, ++place) {
      double& d = panel[i * (panel_rows_[std::size_t(k)] + 1)];
      if (shift.size() > 0) d += shift[unknown_[std::size_t(place)]];
      diagonal_[place] = d;
    }
  }
}

int BlockCholesky::eliminate(int begin, int end, int reach, WeakPivots* weak) {
  return detail::at_best([&]() TANDEM_INLINED_HERE {
    double inverse[detail::kMostDofs];
    int failed = 0;
    for (int k = begin; k < end; ++k) {
      const int n = size_[std::size_t(k)], m = panel_rows_[std::size_t(k)], first = start_[std::size_t(k)];
      double* P = values_.data() + panel_[std::size_t(k)];
      const auto is_weak = [&](int c, double pivot) TANDEM_INLINED_HERE {
        if (!weak || pivot > weak->relative * diagonal_[first + c]) return false;
        weak->places.push_back(first + c);
        return true;
      };
      const bool positive = n == 6   ? detail::factor_panel<6>(n, m, P, inverse, failed, is_weak)
                            : n == 3 ? detail::factor_panel<3>(n, m, P, inverse, failed, is_weak)
                                     : detail::factor_panel<0>(n, m, P, inverse, failed, is_weak);
      if (!positive) return unknown_[std::size_t(first + failed)];
      subtract_updates(update_start_[std::size_t(k)], first_update(k, reach), k, n, P, P);
    }
    return -1;
  });
}

inline int BlockCholesky::first_update(int k, int reach) const {  // one for each block row below the top
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
      detail::subtract_product_any(run.rows, update.columns, inner, values_.data() + run.target, update.target_stride,
                                   A + run.source_row, m, B + update.first_row, m);
    }
  }
}

void BlockCholesky::subtract_below(int k, int inner, const double* A, const double* B) {
  detail::at_best([&]() TANDEM_INLINED_HERE {
    subtract_updates(update_start_[std::size_t(k)], update_start_[std::size_t(k) + 1], k, inner, A, B);
  });
}

bool BlockCholesky::factorize(const Eigen::VectorXd& values, const Eigen::VectorXd& shift) {
  return factorize(values, shift, nullptr);
}

bool BlockCholesky::factorize(const Eigen::VectorXd& values, const Eigen::VectorXd& shift, WeakPivots* weak) {
  const int joint = parts_[2].begin;
  std::array<int, 2> failed{-1, -1};
  for_both([&](int p) {
    const Section& section = parts_[std::size_t(p)];
    load(section, values, shift);
    failed[std::size_t(p)] = eliminate(section.begin, section.end, joint, weak ? &weak[p] : nullptr);
  });
  failed_ = failed[0] >= 0 ? failed[0] : failed[1];
  if (failed_ >= 0) return false;
  load(parts_[2], values, shift);
  // What both parts change of the third, one after the other: sums are those of one thread.
  detail::at_best([&]() TANDEM_INLINED_HERE {
    for (const int k : joints_) {
      const double* P = values_.data() + panel_[std::size_t(k)];
      subtract_updates(first_update(k, joint), update_start_[std::size_t(k) + 1], k, size_[std::size_t(k)], P, P);
    }
  });
  failed_ = eliminate(joint, blocks_, blocks_, weak ? &weak[2] : nullptr);
  return failed_ < 0;
}

std::vector<Eigen::VectorXd> BlockCholesky::null_space(const Eigen::VectorXd& values, double relative, int most) {
  std::array<WeakPivots, 3> of_parts{{{relative, {}}, {relative, {}}, {relative, {}}}};
  factorize(values, {}, of_parts.data());
  std::vector<int> weak;
  for (const WeakPivots& part : of_parts) weak.insert(weak.end(), part.places.begin(), part.places.end());
  std::vector<Eigen::VectorXd> basis;
  for (const int place : weak) {
    if (static_cast<int>(basis.size()) >= most) break;
    Eigen::VectorXd v = Eigen::VectorXd::Zero(n_);
    v[unknown_[std::size_t(place)]] = 1;
    backward(v);
    basis.push_back(v.normalized());
  }
  return basis;
}

}  // namespace tandem
