#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/Core>

#include <tandem/lie/piecewise.hpp>

namespace tandem {

namespace detail {

/// SIMD vector types of W doubles and integers (GCC extension), one specialisation for each supported width. GCC does
/// not accept a width that depends on a template parameter. The alignment of 16 bytes matches Eigen's on every
/// processor.
template <int W>
struct SimdTypes;
template <>
struct SimdTypes<4> {
  typedef double Values __attribute__((vector_size(32), aligned(16)));
  typedef long long Integers __attribute__((vector_size(32), aligned(16)));
};

}  // namespace detail

/// SIMD vector of W doubles. As the scalar of groups and residuals it evaluates W blocks at once, one instruction for
/// each operation if the processor supports the width. Code compiled with other instruction-set flags than the rest of
/// the program must use its own `Tag` from an unnamed namespace. This keeps its template instantiations separate.
template <int W, class Tag = void>
class Batch {
 public:
  using Values = typename detail::SimdTypes<W>::Values;
  struct Mask {
    typename detail::SimdTypes<W>::Integers lanes;  // −1 if the condition holds, else 0
  };
  static constexpr int width = W;

  Batch() = default;
  Batch(double x) {  // NOLINT: implicit, sets all lanes to x
    for (int i = 0; i < W; ++i) v_[i] = x;
  }
  explicit Batch(const Values& v) : v_(v) {}

  double operator[](int i) const { return v_[i]; }
  void set(int i, double x) { v_[i] = x; }

  friend Batch operator+(const Batch& a, const Batch& b) { return Batch(a.v_ + b.v_); }
  friend Batch operator-(const Batch& a, const Batch& b) { return Batch(a.v_ - b.v_); }
  friend Batch operator*(const Batch& a, const Batch& b) { return Batch(a.v_ * b.v_); }
  friend Batch operator/(const Batch& a, const Batch& b) { return Batch(a.v_ / b.v_); }
  Batch operator-() const { return Batch(-v_); }
  Batch& operator+=(const Batch& b) { return v_ += b.v_, *this; }
  Batch& operator-=(const Batch& b) { return v_ -= b.v_, *this; }
  Batch& operator*=(const Batch& b) { return v_ *= b.v_, *this; }
  Batch& operator/=(const Batch& b) { return v_ /= b.v_, *this; }

  friend Batch sqrt(const Batch& x) {
    return x.each([](double a) { return std::sqrt(a); });
  }
  friend Batch sin(const Batch& x) {
    return x.each([](double a) { return std::sin(a); });
  }
  friend Batch cos(const Batch& x) {
    return x.each([](double a) { return std::cos(a); });
  }
  friend Batch atan2(const Batch& y, const Batch& x) {
    Batch r;
    for (int i = 0; i < W; ++i) r.v_[i] = std::atan2(y.v_[i], x.v_[i]);
    return r;
  }

  Mask below(double limit) const { return {v_ < Batch(limit).v_}; }
  static Batch choose(const Mask& mask, const Batch& a, const Batch& b) { return Batch(mask.lanes ? a.v_ : b.v_); }

 private:
  template <class F>
  Batch each(F f) const {
    Batch r;
    for (int i = 0; i < W; ++i) r.v_[i] = f(v_[i]);
    return r;
  }

  Values v_;
};

namespace detail {

template <class Mask, int W, class Tag>
Batch<W, Tag> choose(const Mask& mask, const Batch<W, Tag>& a, const Batch<W, Tag>& b) {
  return Batch<W, Tag>::choose(mask, a, b);
}
template <class Mask, class B, std::size_t N>
std::array<B, N> choose(const Mask& mask, const std::array<B, N>& a, const std::array<B, N>& b) {
  std::array<B, N> r;
  for (std::size_t k = 0; k < N; ++k) r[k] = B::choose(mask, a[k], b[k]);
  return r;
}

/// Selects below() or above() in each lane. Evaluates only one of them if all lanes are on the same side of the limit.
template <int W, class Tag, class Below, class Above>
[[gnu::always_inline]] inline auto piecewise(const Batch<W, Tag>& x, double limit, Below below, Above above)
    -> decltype(below()) {
  const auto mask = x.below(limit);
  int count = 0;
  for (int i = 0; i < W; ++i) count -= static_cast<int>(mask.lanes[i]);
  if (count == W) return below();
  if (count == 0) return above();
  return choose(mask, below(), above());
}

}  // namespace detail
}  // namespace tandem

namespace Eigen {
template <int W, class Tag>
struct NumTraits<tandem::Batch<W, Tag>> : GenericNumTraits<tandem::Batch<W, Tag>> {
  using Real = tandem::Batch<W, Tag>;
  using NonInteger = Real;
  using Literal = Real;
  using Nested = Real;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 0,
    ReadCost = 1,
    AddCost = 1,
    MulCost = 1
  };
};
}  // namespace Eigen
