#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <type_traits>
#include <utility>

#include <Eigen/Dense>

#include <tandem/lie/operations.hpp>

/// Checks that a type that models LieGroup is a Lie group and that its Jacobians are correct. The checks work for any
/// group over double and need no test framework:
///
///     const tandem::check::GroupErrors errors = tandem::check::group<MyGroup>();
///     ASSERT_EQ(errors.report(), "");
namespace tandem::check {

/// Largest error of each identity, by name.
class Errors {
 public:
  /// Records an error; NaN counts as infinite.
  void add(const char* identity, double error) {
    double& largest = largest_[identity];
    largest = std::max(largest, std::isfinite(error) ? error : std::numeric_limits<double>::infinity());
  }
  /// Records the largest difference of two entries, divided by the largest expected entry or `least_scale`, whichever
  /// is larger. The difference is absolute if both are zero.
  void compare(const char* identity, const Eigen::MatrixXd& got, const Eigen::MatrixXd& expected,
               double least_scale = 0.) {
    const double scale = std::max(least_scale, expected.cwiseAbs().maxCoeff());
    const double difference = (got - expected).cwiseAbs().maxCoeff();
    const bool finite = got.allFinite() && expected.allFinite();
    add(identity, !finite ? std::numeric_limits<double>::infinity() : scale > 0. ? difference / scale : difference);
  }
  double largest() const {
    double error = 0.;
    for (const auto& [identity, e] : largest_) error = std::max(error, e);
    return error;
  }
  /// Returns one line for each identity whose error exceeds the tolerance; empty if all hold.
  std::string report(double tolerance) const {
    std::ostringstream out;
    for (const auto& [identity, error] : largest_)
      if (!(error <= tolerance)) out << identity << ": error " << error << ", tolerance " << tolerance << '\n';
    return out.str();
  }
  const std::map<std::string, double>& all() const { return largest_; }

 private:
  std::map<std::string, double> largest_;
};

// ---- helpers that do not depend on a group

using LongMatrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

/// Converts a fixed-size matrix to a dynamic one, so that the functions below are compiled once for all groups.
template <class M>
Eigen::MatrixXd dense(const M& m) {
  return Eigen::Map<const Eigen::MatrixXd>(m.data(), m.rows(), m.cols());
}

/// Returns exp(M), computed by scaling, Taylor series and squaring in long double.
inline Eigen::MatrixXd matrix_exponential(const Eigen::MatrixXd& M) {
  int squarings = 0;
  for (double norm = M.cwiseAbs().rowwise().sum().maxCoeff(); norm > 0.5; norm *= 0.5) ++squarings;
  const LongMatrix A = M.cast<long double>() * std::ldexp(1.L, -squarings);
  LongMatrix term = LongMatrix::Identity(M.rows(), M.cols()), sum = term;
  for (int k = 1; k <= 20; ++k) sum += term = (term * A / k).eval();  // 0.5^21 / 21! < 1e-25
  for (int k = 0; k < squarings; ++k) sum = (sum * sum).eval();
  return sum.cast<double>();
}

/// Returns Σ (sign·ad)^k / (k+1)!, computed in long double: the left Jacobian for sign = 1, the right one for −1.
inline Eigen::MatrixXd jacobian_series(const Eigen::MatrixXd& ad, double sign) {
  const LongMatrix A = (sign * ad).cast<long double>();
  LongMatrix term = LongMatrix::Identity(ad.rows(), ad.cols()), sum = term;
  for (int k = 1; k <= 200; ++k) {
    term = (term * A / (k + 1)).eval();
    sum += term;
    if (term.cwiseAbs().maxCoeff() < 1e-24L * sum.cwiseAbs().maxCoeff()) break;
  }
  return sum.cast<double>();
}

/// Returns the Jacobian at 0 of f: R^N → R^M by five-point central differences. The error is O(step⁴) + O(1e-16 /
/// step).
template <int M, int N, class F>
Matrix<M, N> central_differences(const F& f, double step) {
  constexpr std::array<std::pair<double, double>, 4> stencil{{{1., 8.}, {-1., -8.}, {2., -1.}, {-2., 1.}}};
  Matrix<M, N> J = Matrix<M, N>::Zero();
  for (int i = 0; i < N; ++i) {
    for (const auto& [at, weight] : stencil) {
      Vector<N> d = Vector<N>::Zero();
      d[i] = at * step;
      const Vector<M> r = f(d);
      for (int j = 0; j < M; ++j) J(j, i) += weight * r[j];
    }
    for (int j = 0; j < M; ++j) J(j, i) /= 12. * step;
  }
  return J;
}

// ---- identities of a group

template <LieGroup G>
Eigen::VectorXd vee(const Eigen::MatrixXd& m) {
  return dense(G::vee(typename G::AlgebraMatrix(m.data())));
}

/// Returns ad(v), the matrix of w ↦ vee(hat(v) hat(w) − hat(w) hat(v)).
template <LieGroup G>
Eigen::MatrixXd adjoint_of_algebra(const typename G::Tangent& v) {
  const Eigen::MatrixXd V = dense(G::hat(v));
  Eigen::MatrixXd ad(G::dof, G::dof);
  for (int i = 0; i < G::dof; ++i) {
    typename G::Tangent w = G::Tangent::Zero();
    w[i] = 1.;
    const Eigen::MatrixXd W = dense(G::hat(w));
    ad.col(i) = vee<G>(V * W - W * V);
  }
  return ad;
}

/// Checks identity, associativity and inverse, and that matrix(), act and Ad respect the product.
template <LieGroup G>
void axioms(const G& x, const G& y, const G& z, const typename G::Tangent& v, const Vector<G::point_dim>& p,
            Errors& e) {
  const G one = G::identity(), xi = x.inverse(), xy = x * y;
  const Eigen::MatrixXd X = dense(x.matrix()), Y = dense(y.matrix()), Xi = dense(xi.matrix());
  const Eigen::MatrixXd Adx = dense(x.Ad()), I = Eigen::MatrixXd::Identity(X.rows(), X.cols());
  e.compare("identity has the identity matrix", dense(one.matrix()), I);
  e.compare("1 x = x", dense((one * x).matrix()), X);
  e.compare("x 1 = x", dense((x * one).matrix()), X);
  e.compare("(x y) z = x (y z)", dense((xy * z).matrix()), dense((x * (y * z)).matrix()));
  e.compare("x x^-1 = 1", dense((x * xi).matrix()), I);
  e.compare("x^-1 x = 1", dense((xi * x).matrix()), I);
  e.compare("(x y)^-1 = y^-1 x^-1", dense(xy.inverse().matrix()), dense((y.inverse() * xi).matrix()));
  e.compare("matrix(x y) = matrix(x) matrix(y)", dense(xy.matrix()), X * Y);
  e.compare("matrix(x^-1) matrix(x) = I", Xi * X, I);
  e.compare("act(1, p) = p", dense(one.act(p)), dense(p));
  const double scale = std::max({X.cwiseAbs().maxCoeff(), Y.cwiseAbs().maxCoeff(), dense(p).cwiseAbs().maxCoeff()});
  e.compare("act(x y, p) = act(x, act(y, p))", dense(xy.act(p)), dense(x.act(y.act(p))), scale);
  e.compare("Ad(x y) = Ad(x) Ad(y)", dense(xy.Ad()), Adx * dense(y.Ad()));
  e.compare("Ad(x^-1) Ad(x) = I", dense(xi.Ad()) * Adx, Eigen::MatrixXd::Identity(G::dof, G::dof));
  const Eigen::MatrixXd moved = X * dense(G::hat(v)) * Xi, Adv = Adx * dense(v);
  e.compare("Ad(x) v = vee(X hat(v) X^-1)", Adv, vee<G>(moved));
  e.compare("hat(Ad(x) v) = X hat(v) X^-1", dense(G::hat(typename G::Tangent(Adv.data()))), moved);
}

/// Checks hat and vee, Exp against the matrix exponential, and Log, for v in the range of Log. The error of Log(Exp(v))
/// is relative to v or to `least_scale`. Use 1 for groups whose stored numbers are near 1 (for example a scale factor);
/// these resolve a small tangent only to 1e-16.
template <LieGroup G>
void exponential(const typename G::Tangent& v, Errors& e, double least_scale = 0.) {
  const typename G::Tangent minus_v = -v;
  const G x = G::Exp(v), xi = x.inverse();
  const typename G::AlgebraMatrix hat = G::hat(v);
  const Eigen::MatrixXd X = dense(x.matrix());
  e.compare("vee(hat(v)) = v", dense(G::vee(hat)), dense(v));
  e.compare("matrix(Exp(v)) = exp(hat(v))", X, matrix_exponential(dense(hat)));
  e.compare("Exp(-v) = Exp(v)^-1", dense(G::Exp(minus_v).matrix()), dense(xi.matrix()));
  e.compare("Log(Exp(v)) = v", dense(x.Log()), dense(v), least_scale);
  e.compare("Log(Exp(-v)) = -v", dense(xi.Log()), dense(minus_v), least_scale);
  e.compare("Exp(Log(x)) = x", dense(G::Exp(x.Log()).matrix()), X);
}

/// Checks the Jacobians of Exp and their inverses against the power series and against each other.
template <LieGroup G>
void jacobians(const typename G::Tangent& v, Errors& e) {
  const typename G::Tangent minus_v = -v;
  const Eigen::MatrixXd Jr = dense(G::Jr(v)), Jl = dense(G::Jl(v)), ad = adjoint_of_algebra<G>(v);
  const Eigen::MatrixXd Jri = dense(G::Jr_inverse(v)), Jli = dense(G::Jl_inverse(v));
  const Eigen::MatrixXd I = Eigen::MatrixXd::Identity(G::dof, G::dof);
  e.compare("Jr(v) = sum (-ad)^k / (k+1)!", Jr, jacobian_series(ad, -1.));
  e.compare("Jl(v) = sum ad^k / (k+1)!", Jl, jacobian_series(ad, 1.));
  e.compare("Jl(v) = Ad(Exp(v)) Jr(v)", Jl, dense(G::Exp(v).Ad()) * Jr);
  e.compare("Jl(v) = Jr(-v)", Jl, dense(G::Jr(minus_v)));
  e.compare("Jl_inverse(v) = Jr_inverse(-v)", Jli, dense(G::Jr_inverse(minus_v)));
  e.compare("Jr Jr_inverse = I", Jr * Jri, I);
  e.compare("Jr_inverse Jr = I", Jri * Jr, I);
  e.compare("Jl Jl_inverse = I", Jl * Jli, I);
  e.compare("Jl_inverse Jl = I", Jli * Jl, I);
}

/// Checks the values of the operations: plus and minus are inverse to each other, and interpolate() starts and ends at
/// its arguments.
template <LieGroup G>
void operations(const G& x, const typename G::Tangent& v, const Vector<G::point_dim>& p, Errors& e) {
  const typename G::Tangent part = 0.3 * v;
  const G w = Exp<G>(v), y = plus(x, v);
  const Eigen::MatrixXd X = dense(x.matrix()), Y = dense(y.matrix());
  e.compare("plus(x, v) = x Exp(v)", Y, dense((x * w).matrix()));
  e.compare("compose(x, y) = x y", dense(compose(x, y).matrix()), dense((x * y).matrix()));
  e.compare("inverse(x) = x^-1", dense(inverse(x).matrix()), dense(x.inverse().matrix()));
  e.compare("between(x, x Exp(v)) = Exp(v)", dense(between(x, y).matrix()), dense(w.matrix()));
  e.compare("Log(x) = x.Log()", dense(Log(w)), dense(w.Log()));
  e.compare("act(x, p) = x.act(p)", dense(act(x, p)), dense(x.act(p)));
  e.compare("interpolate(x, y, 0) = x", dense(interpolate(x, y, 0.).matrix()), X);
  e.compare("interpolate(x, y, 1) = y", dense(interpolate(x, y, 1.).matrix()), Y);
  e.compare("interpolate(x, y, s) = x Exp(s v)", dense(interpolate(x, y, 0.3).matrix()), dense(plus(x, part).matrix()));
  // x⁻¹ (x Exp(v)) represents v to the precision of the entries of x, so these set the scale.
  const double scale = std::max({1., dense(v).cwiseAbs().maxCoeff(), X.cwiseAbs().maxCoeff()});
  e.add("minus(plus(x, v), x) = v", (dense(minus(y, x)) - dense(v)).cwiseAbs().maxCoeff() / scale);
}

// ---- Jacobians of the operations

/// Returns x with scalar T: a copy for double, a cast for dual numbers.
template <class T, class G>
auto over(const G& x) {
  if constexpr (std::is_same_v<T, typename G::Scalar>) {
    return x;
  } else {
    return x.template cast<T>();
  }
}

/// Calls check(name, J, f) for each Jacobian J of operations.hpp at x, v and x Exp(v), the point p and the ratio s. The
/// function f maps a perturbation of one argument to the result of the operation; J should be its derivative at 0. It
/// accepts vectors over any scalar that `G::cast` accepts, such as dual numbers.
template <LieGroup G, class Check>
void for_each_jacobian(const G& x, const typename G::Tangent& v, const Vector<G::point_dim>& p, double s,
                       const Check& check) {
  const auto same = []<int N, class T>(const G& a, const Vector<N, T>&) { return over<T>(a); };
  const auto moved = []<int N, class T>(const G& a, const Vector<N, T>& d) { return plus(over<T>(a), d); };
  // Tangent from a to b: the chart around the unperturbed result.
  const auto change = []<class H>(const G& a, const H& b) { return minus(b, over<typename H::Scalar>(a)); };
  const auto over_vector = []<int N, int M, class T>(const Vector<N>& a, const Vector<M, T>&) {
    return Vector<N, T>(a.template cast<T>());
  };
  const auto sum = []<int N, class T>(const Vector<N>& a, const Vector<N, T>& d) {
    return Vector<N, T>(a.template cast<T>() + d);
  };

  const G w = G::Exp(v), y = x * w;
  typename G::Jacobian J, K;

  compose(x, w, &J, &K);
  check("compose, first", J, [&](const auto& d) { return change(y, compose(moved(x, d), same(w, d))); });
  check("compose, second", K, [&](const auto& d) { return change(y, compose(same(x, d), moved(w, d))); });

  const G xi = inverse(x, &J);
  check("inverse", J, [&](const auto& d) { return change(xi, inverse(moved(x, d))); });

  const G b = between(x, y, &J, &K);
  check("between, first", J, [&](const auto& d) { return change(b, between(moved(x, d), same(y, d))); });
  check("between, second", K, [&](const auto& d) { return change(b, between(same(x, d), moved(y, d))); });

  Exp<G>(v, &J);
  check("Exp", J, [&](const auto& d) { return change(w, Exp<decltype(same(w, d))>(sum(v, d))); });

  Log(w, &J);
  check("Log", J, [&](const auto& d) { return Log(moved(w, d)); });

  plus(x, v, &J, &K);
  check("plus, group", J, [&](const auto& d) { return change(y, plus(moved(x, d), over_vector(v, d))); });
  check("plus, tangent", K, [&](const auto& d) { return change(y, plus(same(x, d), sum(v, d))); });

  minus(y, x, &J, &K);
  check("minus, first", J, [&](const auto& d) { return minus(moved(y, d), same(x, d)); });
  check("minus, second", K, [&](const auto& d) { return minus(same(y, d), moved(x, d)); });

  Matrix<G::point_dim, G::dof> Jx;
  Matrix<G::point_dim, G::point_dim> Jp;
  act(x, p, &Jx, &Jp);
  check("act, group", Jx, [&](const auto& d) { return act(moved(x, d), over_vector(p, d)); });
  check("act, point", Jp, [&](const auto& d) { return act(same(x, d), sum(p, d)); });

  const G z = interpolate(x, y, s, &J, &K);
  check("interpolate, first", J,
        [&]<int N, class T>(const Vector<N, T>& d) { return change(z, interpolate(moved(x, d), same(y, d), T(s))); });
  check("interpolate, second", K,
        [&]<int N, class T>(const Vector<N, T>& d) { return change(z, interpolate(same(x, d), moved(y, d), T(s))); });
}

/// Checks every Jacobian of operations.hpp against central differences. Choose `step` so that x Exp(v) ± 2 step avoids
/// the discontinuity of Log.
template <LieGroup G>
void differences(const G& x, const typename G::Tangent& v, const Vector<G::point_dim>& p, double s, double step,
                 Errors& e) {
  for_each_jacobian(x, v, p, s, [&]<int M, int N>(const char* name, const Matrix<M, N>& J, const auto& f) {
    e.compare(name, dense(J), dense(central_differences<M, N>(f, step)), 1.);
  });
}

// ---- all checks together

/// Largest errors over the samples of group().
struct GroupErrors {
  Errors identities;   ///< relative errors, of the order of rounding
  Errors differences;  ///< analytic Jacobians against central differences with step 1e-3

  /// Returns an empty string if all checks pass, otherwise one line for each failure. The default tolerances suit
  /// elements of order one: rounding for the identities, truncation step⁴/30 f⁽⁵⁾ and rounding 1e-16 / step for the
  /// differences.
  std::string report(double identities_within = 1e-13, double differences_within = 1e-10) const {
    return identities.report(identities_within) + differences.report(differences_within);
  }
};

/// Runs all checks at random elements, with tangents of norms from 0 to `largest_norm`. The norm must lie in the range
/// of Log, at least 0.01 from its discontinuity.
template <LieGroup G>
GroupErrors group(double largest_norm = 3., unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto tangent = [&](double norm) {
    typename G::Tangent v;
    for (int i = 0; i < G::dof; ++i) v[i] = normal(random);
    return typename G::Tangent(norm * v.normalized());
  };
  GroupErrors errors;
  for (const double part : {0., 1e-12, 1e-8, 1e-4, 0.01, 0.1, 0.3, 0.6, 1.}) {
    for (int repeat = 0; repeat < 5; ++repeat) {
      const typename G::Tangent v = tangent(part * largest_norm);
      const G x = G::Exp(tangent(largest_norm)), z = G::Exp(tangent(largest_norm));
      Vector<G::point_dim> p;
      for (int i = 0; i < G::point_dim; ++i) p[i] = normal(random);
      axioms(x, G::Exp(v), z, v, p, errors.identities);
      exponential<G>(v, errors.identities, 1.);
      jacobians<G>(v, errors.identities);
      operations(x, v, p, errors.identities);
      differences(x, v, p, 0.3, 1e-3, errors.differences);
    }
  }
  return errors;
}

}  // namespace tandem::check
