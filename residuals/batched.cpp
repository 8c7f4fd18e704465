#include <utility>

#include <tandem/lie/batch.hpp>
#include <tandem/residuals/batched.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/relative_pose.hpp>

// Compiled for AVX2 if the compiler supports it, and called only on processors with AVX2. Functions that are not
// templates over B would be shared with the rest of the program, so they must be inlined here.
// tests/residuals/batched_symbols.cmake checks this.
namespace tandem::detail {
namespace {

struct FileTag;
using B = Batch<kBatch, FileTag>;
using BatchSE3 = BasicSE3<B>;

// An SE3 is stored as quaternion (x y z w) and position. It is read as plain numbers, so that no member function for
// double is compiled here.
static_assert(sizeof(SE3) == 8 * sizeof(double) && sizeof(SO3) == 4 * sizeof(double));

BatchSE3 gather(const std::array<const SE3*, kBatch>& x) {
  std::array<B, 7> n;
  for (int i = 0; i < kBatch; ++i) {
    const double* from = reinterpret_cast<const double*>(x[std::size_t(i)]);
    for (std::size_t k = 0; k < 7; ++k) n[k].set(i, from[k]);
  }
  return BatchSE3(BasicSO3<B>::from_unit({n[3], n[0], n[1], n[2]}), {n[4], n[5], n[6]});
}

template <class Member, class R>
BatchSE3 gather(const std::array<const R*, kBatch>& residual, Member member) {
  std::array<const SE3*, kBatch> x;
  for (std::size_t i = 0; i < kBatch; ++i) x[i] = &(residual[i]->*member);
  return gather(x);
}
template <class R>
B gather_number(const std::array<const R*, kBatch>& residual, double R::*member) {
  B n;
  for (std::size_t i = 0; i < kBatch; ++i) n.set(int(i), residual[i]->*member);
  return n;
}

RelativePose<BatchSE3> over_batch(const std::array<const RelativePose<SE3>*, kBatch>& r) {
  using R = RelativePose<SE3>;
  return {gather(r, &R::z), gather(r, &R::B), gather(r, &R::F)};
}
ConstantTwist<BatchSE3> over_batch(const std::array<const ConstantTwist<SE3>*, kBatch>& r) {
  using R = ConstantTwist<SE3>;
  return {gather_number(r, &R::dt1), gather_number(r, &R::dt2)};
}

template <int rows, int columns>
void scatter(const Matrix<rows, columns, B>& from, double* to) {
  constexpr int size = rows * columns;
  for (int k = 0; k < size; ++k)
    for (int i = 0; i < kBatch; ++i) to[i * size + k] = from.data()[k][i];
}

}  // namespace

template <class R, int kArity>
void BatchedSE3<R, kArity>::linearize(const std::array<const R*, kBatch>& residual, const States& x, double* r,
                                      const std::array<double*, std::size_t(kArity)>& J) {
  [&]<std::size_t... S>(std::index_sequence<S...>) {
    Vector<6, B> rows;
    std::array<Matrix<6, 6, B>, std::size_t(kArity)> jacobian;
    over_batch(residual)(gather(x[S])..., rows, &jacobian[S]...);
    scatter(rows, r);
    (scatter(jacobian[S], J[S]), ...);
  }
  (std::make_index_sequence<std::size_t(kArity)>());
}

template <class R, int kArity>
void BatchedSE3<R, kArity>::evaluate(const std::array<const R*, kBatch>& residual, const States& x, double* r) {
  Vector<6, B> rows;
  std::apply([&](const auto&... state) { over_batch(residual)(gather(state)..., rows); }, x);
  scatter(rows, r);
}

template <class R, int kArity>
void BatchedSE3<R, kArity>::curvature(const std::array<const R*, kBatch>& residual, const States& x, const double* w,
                                      double* H) {
  Vector<6, B> weights;
  for (int k = 0; k < 6; ++k)
    for (int i = 0; i < kBatch; ++i) weights[k].set(i, w[i * 6 + k]);
  Matrix<6 * kArity, 6 * kArity, B> curvature;
  std::apply([&](const auto&... state) { over_batch(residual).curvature(gather(state)..., weights, curvature); }, x);
  scatter(curvature, H);
}

template struct BatchedSE3<RelativePose<SE3>, 2>;
template struct BatchedSE3<ConstantTwist<SE3>, 3>;

}  // namespace tandem::detail
