#pragma once

#include <ceres/jet.h>

#include <tandem/lie/testing.hpp>

#include "samples.hpp"
#include "sanitized.hpp"

namespace tandem {

using Jet = ceres::Jet<double, 1>;  // one direction at a time

/// Returns the Jacobian at 0 of f, which maps vectors of dual numbers to vectors of dual numbers.
template <int M, int N, class F>
Matrix<M, N> dual_derivative(const F& f) {
  Matrix<M, N> J;
  for (int i = 0; i < N; ++i) {
    Vector<N, Jet> d = Vector<N, Jet>::Zero();
    d[i].v[0] = 1.;
    const Vector<M, Jet> r = f(d);
    for (int j = 0; j < M; ++j) J(j, i) = r[j].v[0];
  }
  return J;
}

/// Compares every Jacobian of operations.hpp with forward automatic differentiation.
template <class G>
class DualNumbers : public ::testing::Test {
 protected:
  void compare(const G& x, const typename G::Tangent& v, const Vector<G::point_dim>& p, double s) {
    check::for_each_jacobian(x, v, p, s, [&]<int M, int N>(const char* name, const Matrix<M, N>& J, const auto& f) {
      errors_.compare(name, check::dense(J), check::dense(dual_derivative<M, N>(f)), 1.);
    });
  }
  // Defined here, so that the instantiations can be split over several files.
  void run() {
    for (const double angle : test_angles())
      for (const double s : {0., 0.3, 1., 1.5})
        for (int i = 0; i < (kSanitized ? 1 : 3); ++i)
          compare(samples_.element<G>(), samples_.tangent<G>(angle), samples_.vector<G::point_dim>(), s);
    // At exactly θ = 0 the derivatives of square roots and arc tangents would be NaN, which counts as an infinite
    // error.
    const typename G::Tangent zero = G::Tangent::Zero();
    for (const double s : {0., 0.3, 1.}) {
      compare(G::identity(), zero, Vector<G::point_dim>::Zero(), s);
      compare(samples_.element<G>(), zero, samples_.vector<G::point_dim>(), s);
    }
    // Both sides are exact up to rounding.
    EXPECT_EQ(errors_.report(1e-14), "");
    this->RecordProperty("largest_error", std::to_string(errors_.largest() * 1e15) + "e-15");
  }

 private:
  Samples samples_;
  check::Errors errors_;
};

}  // namespace tandem
