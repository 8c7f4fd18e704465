#pragma once

#include <array>
#include <tuple>

#include <tandem/lie/lie_group.hpp>
#include <tandem/lie/static_for.hpp>

namespace tandem {

/// Direct product of groups, e.g. Bundle<SE3, R3, Rn<6>> for pose, velocity and biases. Tangents and points are stacked
/// in the order of the parts; matrices and Jacobians are block-diagonal.
template <LieGroup... Gs>
class Bundle {
  static_assert(sizeof...(Gs) > 0);

 public:
  static constexpr int size = sizeof...(Gs);
  static constexpr int dof = (Gs::dof + ...), matrix_size = (Gs::matrix_size + ...), point_dim = (Gs::point_dim + ...);
  using Parts = std::tuple<Gs...>;
  template <int I>
  using Part = std::tuple_element_t<I, Parts>;
  using Scalar = typename Part<0>::Scalar;
  using Tangent = Vector<dof, Scalar>;
  using Jacobian = Matrix<dof, dof, Scalar>;
  using AlgebraMatrix = Matrix<matrix_size, matrix_size, Scalar>;
  using Point = Vector<point_dim, Scalar>;
  template <class Other>
  using Rebind = Bundle<typename Gs::template Rebind<Other>...>;

  Bundle() = default;
  explicit Bundle(const Gs&... parts) : parts_(parts...) {}

  template <int I>
  const Part<I>& get() const {
    return std::get<I>(parts_);
  }
  template <int I>
  Part<I>& get() {
    return std::get<I>(parts_);
  }
  /// Returns the first row of part I in a tangent.
  template <int I>
  static constexpr int offset() {
    return offsets<Dof>[I];
  }

  static Bundle identity() { return {}; }
  static Bundle Exp(const Tangent& v) {
    Bundle x;
    each([&]<int I>() { x.get<I>() = Part<I>::Exp(tangent<I>(v)); });
    return x;
  }
  Tangent Log() const {
    Tangent v;
    each([&]<int I>() { v.template segment<Part<I>::dof>(offsets<Dof>[I]) = get<I>().Log(); });
    return v;
  }
  Bundle inverse() const {
    Bundle x;
    each([&]<int I>() { x.get<I>() = get<I>().inverse(); });
    return x;
  }
  Bundle operator*(const Bundle& y) const {
    Bundle x;
    each([&]<int I>() { x.get<I>() = get<I>() * y.get<I>(); });
    return x;
  }
  Point act(const Point& p) const {
    Point q;
    each([&]<int I>() {
      constexpr int n = Part<I>::point_dim, o = offsets<PointDim>[I];
      q.template segment<n>(o) = get<I>().act(p.template segment<n>(o));
    });
    return q;
  }
  Matrix<point_dim, dof, Scalar> act_jacobian(const Point& p) const {
    Matrix<point_dim, dof, Scalar> J = Matrix<point_dim, dof, Scalar>::Zero();
    each([&]<int I>() {
      constexpr int n = Part<I>::point_dim, o = offsets<PointDim>[I];
      J.template block<n, Part<I>::dof>(o, offsets<Dof>[I]) = get<I>().act_jacobian(p.template segment<n>(o));
    });
    return J;
  }
  Matrix<point_dim, point_dim, Scalar> act_point_jacobian() const {
    return blocks<Matrix<point_dim, point_dim, Scalar>, PointDim>(
        [&]<int I>() { return get<I>().act_point_jacobian(); });
  }
  AlgebraMatrix matrix() const {
    return blocks<AlgebraMatrix, MatrixSize>([&]<int I>() { return get<I>().matrix(); });
  }

  Jacobian Ad() const {
    return blocks<Jacobian, Dof>([&]<int I>() { return get<I>().Ad(); });
  }
  static Jacobian Jl(const Tangent& v) {
    return blocks<Jacobian, Dof>([&]<int I>() { return Part<I>::Jl(tangent<I>(v)); });
  }
  static Jacobian Jr(const Tangent& v) {
    return blocks<Jacobian, Dof>([&]<int I>() { return Part<I>::Jr(tangent<I>(v)); });
  }
  static Jacobian Jl_inverse(const Tangent& v) {
    return blocks<Jacobian, Dof>([&]<int I>() { return Part<I>::Jl_inverse(tangent<I>(v)); });
  }
  static Jacobian Jr_inverse(const Tangent& v) {
    return blocks<Jacobian, Dof>([&]<int I>() { return Part<I>::Jr_inverse(tangent<I>(v)); });
  }
  /// Returns the matrix of the Lie bracket: hat(ad(v) w) = hat(v) hat(w) − hat(w) hat(v).
  static Jacobian ad(const Tangent& v) {
    return blocks<Jacobian, Dof>([&]<int I>() { return Part<I>::ad(tangent<I>(v)); });
  }
  /// Returns the largest rotation angle of the parts [rad].
  static Scalar angle(const Tangent& v) {
    Scalar largest(0.);
    each([&]<int I>() {
      const Scalar a = Part<I>::angle(tangent<I>(v));
      if (a > largest) largest = a;
    });
    return largest;
  }
  static AlgebraMatrix hat(const Tangent& v) {
    return blocks<AlgebraMatrix, MatrixSize>([&]<int I>() { return Part<I>::hat(tangent<I>(v)); });
  }
  static Tangent vee(const AlgebraMatrix& m) {
    Tangent v;
    each([&]<int I>() {
      constexpr int n = Part<I>::matrix_size, o = offsets<MatrixSize>[I];
      v.template segment<Part<I>::dof>(offsets<Dof>[I]) = Part<I>::vee(m.template block<n, n>(o, o));
    });
    return v;
  }

  template <class T>
  Rebind<T> cast() const {
    return std::apply([](const Gs&... x) { return Rebind<T>(x.template cast<T>()...); }, parts_);
  }

 private:
  template <class G>
  struct Dof : std::integral_constant<int, G::dof> {};
  template <class G>
  struct MatrixSize : std::integral_constant<int, G::matrix_size> {};
  template <class G>
  struct PointDim : std::integral_constant<int, G::point_dim> {};

  template <template <class> class Size>
  static constexpr std::array<int, size> offsets = [] {
    const std::array<int, size> sizes{Size<Gs>::value...};
    std::array<int, size> o{};
    for (std::size_t i = 1; i < o.size(); ++i) o[i] = o[i - 1] + sizes[i - 1];
    return o;
  }();

  template <class F>
  static void each(F f) {
    detail::static_for<size>(f);
  }
  template <class M, template <class> class Size, class F>
  static M blocks(F f) {
    M m = M::Zero();
    each([&]<int I>() {
      constexpr int n = Size<Part<I>>::value, o = offsets<Size>[I];
      m.template block<n, n>(o, o) = f.template operator()<I>();
    });
    return m;
  }
  template <int I>
  static typename Part<I>::Tangent tangent(const Tangent& v) {
    return v.template segment<Part<I>::dof>(offsets<Dof>[I]);
  }

  Parts parts_;
};

}  // namespace tandem
