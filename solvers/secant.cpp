#include <algorithm>
#include <cmath>

#include <tandem/problem/instruction_set.hpp>
#include <tandem/problem/populate.hpp>
#include <tandem/solvers/secant.hpp>

namespace tandem::detail {
namespace {

/// aᵀ b, by eight sums, so that it goes by vectors.
template <class B>
TANDEM_INLINED double dot(Eigen::Index n, const float* a, const B* b) {
  double sums[8] = {};
  Eigen::Index i = 0;
  for (; i + 8 <= n; i += 8)
    for (int k = 0; k < 8; ++k) sums[k] += double(a[i + k]) * double(b[i + k]);
  double sum = ((sums[0] + sums[1]) + (sums[2] + sums[3])) + ((sums[4] + sums[5]) + (sums[6] + sums[7]));
  for (; i < n; ++i) sum += double(a[i]) * double(b[i]);
  return sum;
}

}  // namespace

SecantPairs::SecantPairs(const LaneParts& parts, Eigen::Index unknowns, int capacity, bool with_term)
    : parts_(parts),
      with_term_(with_term),
      s_(unknowns, capacity),
      y_(unknowns, capacity),
      total_(unknowns, with_term ? capacity : 0),
      sy_(capacity, capacity),
      rho_(capacity),
      alpha_(capacity),
      weight_(capacity),
      product_(capacity + 2),
      products_(Eigen::MatrixXd::Zero(capacity + 2, kMostLanes)),
      wide_s_(with_term ? unknowns : 0),
      wide_y_(with_term ? unknowns : 0) {}

void SecantPairs::add(const Eigen::VectorXd& step, const Eigen::VectorXd& gradient_before,
                      const Eigen::VectorXd& gradient_after) {
  if (capacity() == 0) return;
  const Eigen::Index i = count_ % capacity();
  if (count_ < capacity())
    for (Eigen::MatrixXf* pairs : {&s_, &y_}) populate(pairs->col(i).data(), std::size_t(step.size()) * sizeof(float));
  parts_.each([&](int, Eigen::Index begin, Eigen::Index size) {
    s_.col(i).segment(begin, size) = step.segment(begin, size).cast<float>();
    y_.col(i).segment(begin, size) =
        (gradient_after.segment(begin, size) - gradient_before.segment(begin, size)).cast<float>();
  });
  ++count_;
  find_curvature(count_ - 1, y_);
  if (rho_[i] > 0 || with_term_) return;
  for (Eigen::MatrixXf* pairs : {&s_, &y_}) pairs->col(i).setZero();  // whatever it was
  --count_;
}

void SecantPairs::refresh(FunctionRef<void(const Eigen::VectorXd& s, Eigen::VectorXd& y)> add_product) {
  for (Eigen::Index k = oldest(); k < count_; ++k) {
    const Eigen::Index i = k % capacity();
    wide_s_ = s_.col(i).cast<double>();
    wide_y_ = y_.col(i).cast<double>();
    add_product(wide_s_, wide_y_);
    total_.col(i) = wide_y_.cast<float>();
    find_curvature(k, total_);
  }
}

void SecantPairs::apply(Eigen::VectorXd& d, FunctionRef<void(Eigen::VectorXd& d)> solve) {
  if (count_ == 0) return solve(d);
  const Eigen::MatrixXf& y = with_term_ ? total_ : y_;
  multiply_transposed(s_, d);
  for (Eigen::Index k = count_; k-- > oldest();) {
    const Eigen::Index i = k % capacity();
    for (Eigen::Index newer = k + 1; newer < count_; ++newer)
      product_[i] -= alpha_[newer % capacity()] * sy_(i, newer % capacity());
    alpha_[i] = rho_[i] > 0 ? rho_[i] * product_[i] : 0.0;
    weight_[i] = -alpha_[i];
  }
  add_multiplied(y, d);
  solve(d);
  multiply_transposed(y, d);
  for (Eigen::Index k = oldest(); k < count_; ++k) {
    const Eigen::Index i = k % capacity();
    for (Eigen::Index older = oldest(); older < k; ++older)
      product_[i] += weight_[older % capacity()] * sy_(older % capacity(), i);
    weight_[i] = rho_[i] > 0 ? alpha_[i] - rho_[i] * product_[i] : 0.0;
  }
  add_multiplied(s_, d);
}

/// The k-th pair's 1 / sᵀy, or 0, which leaves the pair out, and the products of its y with the steps up to its own.
void SecantPairs::find_curvature(Eigen::Index k, const Eigen::MatrixXf& y) {
  const Eigen::Index i = k % capacity(), squares = capacity();
  parts_.each([&](int part, Eigen::Index begin, Eigen::Index size) {
    at_best([&]() TANDEM_INLINED_HERE {
      const float *y_i = y.col(i).data() + begin, *s_i = s_.col(i).data() + begin;
      for (Eigen::Index older = oldest(); older <= k; ++older) {
        const Eigen::Index j = older % capacity();
        products_(j, part) = dot(size, s_.col(j).data() + begin, y_i);
      }
      products_(squares, part) = dot(size, s_i, s_i);
      products_(squares + 1, part) = dot(size, y_i, y_i);
    });
  });
  product_ = products_.leftCols(parts_.count()).rowwise().sum();
  sy_.col(i) = product_.head(capacity());
  const double sy = sy_(i, i), scale = std::sqrt(product_[squares]) * std::sqrt(product_[squares + 1]);
  rho_[i] = sy > 1e-8 * scale ? 1.0 / sy : 0.0;
}

void SecantPairs::multiply_transposed(const Eigen::MatrixXf& A, const Eigen::VectorXd& d) {
  const Eigen::Index pairs = std::min(count_, capacity());
  parts_.each([&](int part, Eigen::Index begin, Eigen::Index size) {
    at_best([&]() TANDEM_INLINED_HERE {
      for (Eigen::Index i = 0; i < pairs; ++i)
        products_(i, part) = dot(size, A.col(i).data() + begin, d.data() + begin);
    });
  });
  product_ = products_.leftCols(parts_.count()).rowwise().sum();
}

void SecantPairs::add_multiplied(const Eigen::MatrixXf& A, Eigen::VectorXd& d) const {
  const Eigen::Index pairs = std::min(count_, capacity());
  parts_.each([&](int, Eigen::Index begin, Eigen::Index size) {
    at_best([&]() TANDEM_INLINED_HERE {
      double* to = d.data() + begin;
      for (Eigen::Index i = 0; i < pairs; ++i) {
        const float* from = A.col(i).data() + begin;
        const double weight = weight_[i];
        for (Eigen::Index k = 0; k < size; ++k) to[k] += weight * double(from[k]);
      }
    });
  });
}

}  // namespace tandem::detail
