#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/Core>

#include <tandem/lie/piecewise.hpp>

namespace tandem {

namespace detail {

/// The compiler's vectors of W numbers, by the widths there are (GCC takes none that depends on a parameter), aligned as Eigen
/// aligns its arrays on any processor.
template <int W>
struct VectorsOf;
template <>
struct VectorsOf<4> {
  typedef double Values __attribute__((vector_size(32), aligned(16)));
  typedef long long Integers __attribute__((vector_size(32), aligned(16)));
};

}  // namespace detail

/// W doubles side by side, the scalar of groups and residuals that are evaluated for W blocks at once: each operation is one
/// instruction where the processor has vectors so wide. What is compiled for other instructions than the rest of a program
/// takes a `Tag` of its own, in an unnamed namespace, so that it stays apart.
template <int W, class Tag = void>
class Batch {
 public:
  using Values = typename detail::VectorsOf<W>::Values;
  struct Mask {
    typename detail::VectorsOf<W>::Integers lanes;  // −1 where it holds, 0 elsewhere
  };
  static constexpr int width = W;

  Batch() = default;
  Batch(double x) {  // NOLINT: doubles are batches of one value
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

/// Both expressions where the batch is on both sides, or else the one that counts.
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
