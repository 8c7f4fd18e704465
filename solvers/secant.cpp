#include <algorithm>
#include <cmath>

#include <tandem/problem/instruction_set.hpp>
#include <tandem/problem/prefault.hpp>
#include <tandem/solvers/secant.hpp>

namespace tandem::detail {
namespace {

/// Returns aᵀ b, by eight partial sums that the compiler can vectorise.
template <class A, class B>
TANDEM_INLINED double dot(Eigen::Index n, const A* a, const B* b) {
  double sums[8] = {};
  Eigen::Index i = 0;
  for (; i + 8 <= n; i += 8)
    for (int k = 0; k < 8; ++k) sums[k] += double(a[i + k]) * double(b[i + k]);
  double sum = ((sums[0] + sums[1]) + (sums[2] + sums[3])) + ((sums[4] + sums[5]) + (sums[6] + sums[7]));
  for (; i < n; ++i) sum += double(a[i]) * double(b[i]);
  return sum;
}

/// Adds w a to d if `a` is not null, then returns bᵀ d if `b` is not null, otherwise 0.
template <class Scalar>
TANDEM_INLINED double add_and_multiply(Eigen::Index n, double w, const Scalar* a, const Scalar* b, double* d) {
  if (a)
    for (Eigen::Index i = 0; i < n; ++i) d[i] += w * double(a[i]);
  return b ? dot(n, b, d) : 0.0;
}

}  // namespace

template <class Scalar>
SecantPairs<Scalar>::SecantPairs(const ChunkedLoop& parts, Eigen::Index unknowns, int capacity, bool with_term)
    : parts_(parts),
      with_term_(with_term),
      s_(unknowns, capacity),
      y_(unknowns, capacity),
      total_(unknowns, with_term ? capacity : 0),
      rho_(capacity),
      weight_(capacity),
      wide_s_(with_term ? unknowns : 0),
      wide_y_(with_term ? unknowns : 0) {}

template <class Scalar>
void SecantPairs<Scalar>::add(const Eigen::VectorXd& step, const Eigen::VectorXd& gradient_before,
                              const Eigen::VectorXd& gradient_after) {
  if (capacity() == 0) return;
  const Eigen::Index i = count_ % capacity();
  if (count_ < capacity())
    for (Matrix* pairs : {&s_, &y_}) prefault(pairs->col(i).data(), std::size_t(step.size()) * sizeof(Scalar));
  parts_.each([&](int, Eigen::Index begin, Eigen::Index size) {
    s_.col(i).segment(begin, size) = step.segment(begin, size).template cast<Scalar>();
    y_.col(i).segment(begin, size) =
        (gradient_after.segment(begin, size) - gradient_before.segment(begin, size)).template cast<Scalar>();
  });
  rho_[i] = inverse_curvature(i, y_);
  if (rho_[i] > 0 || with_term_) ++count_;
}

template <class Scalar>
void SecantPairs<Scalar>::refresh(FunctionRef<void(const Eigen::VectorXd& s, Eigen::VectorXd& y)> add_product) {
  for (Eigen::Index k = oldest(); k < count_; ++k) {
    const Eigen::Index i = k % capacity();
    wide_s_ = s_.col(i).template cast<double>();
    wide_y_ = y_.col(i).template cast<double>();
    add_product(wide_s_, wide_y_);
    total_.col(i) = wide_y_.template cast<Scalar>();
    rho_[i] = inverse_curvature(i, total_);
  }
}

template <class Scalar>
void SecantPairs<Scalar>::apply(Eigen::VectorXd& d, FunctionRef<void(Eigen::VectorXd& d)> solve) {
  const Matrix& y = with_term_ ? total_ : y_;
  Eigen::Index last = -1;  // pair whose contribution is still to be added
  for (Eigen::Index k = count_; k-- > oldest();) {
    const Eigen::Index i = k % capacity();
    if (rho_[i] == 0) continue;
    weight_[i] = rho_[i] * add_and_multiply(last < 0 ? 0.0 : -weight_[last], y, last, s_, i, d);
    last = i;
  }
  if (last >= 0) add_and_multiply(-weight_[last], y, last, s_, -1, d);
  solve(d);
  last = -1;
  for (Eigen::Index k = oldest(); k < count_; ++k) {
    const Eigen::Index i = k % capacity();
    if (rho_[i] == 0) continue;
    weight_[i] -= rho_[i] * add_and_multiply(last < 0 ? 0.0 : weight_[last], s_, last, y, i, d);
    last = i;
  }
  if (last >= 0) add_and_multiply(weight_[last], s_, last, y, -1, d);
}

template <class Scalar>
double SecantPairs<Scalar>::inverse_curvature(Eigen::Index i, const Matrix& y) const {
  const auto product = [&](const Matrix& a, const Matrix& b) {
    return parts_.sum([&](Eigen::Index begin, Eigen::Index size) {
      return dispatch_simd(
          [&]() TANDEM_INLINED_HERE { return dot(size, a.col(i).data() + begin, b.col(i).data() + begin); });
    });
  };
  const double sy = product(s_, y);
  return sy > 1e-8 * std::sqrt(product(s_, s_)) * std::sqrt(product(y, y)) ? 1.0 / sy : 0.0;
}

template <class Scalar>
double SecantPairs<Scalar>::add_and_multiply(double w, const Matrix& A, Eigen::Index a, const Matrix& B, Eigen::Index b,
                                             Eigen::VectorXd& d) const {
  return parts_.sum([&](Eigen::Index begin, Eigen::Index size) {
    const Scalar *of_A = a < 0 ? nullptr : A.col(a).data() + begin, *of_B = b < 0 ? nullptr : B.col(b).data() + begin;
    return dispatch_simd(
        [&]() TANDEM_INLINED_HERE { return tandem::detail::add_and_multiply(size, w, of_A, of_B, d.data() + begin); });
  });
}

template class SecantPairs<float>;
template class SecantPairs<double>;

}  // namespace tandem::detail
