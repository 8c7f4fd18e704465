#pragma once

#include <cmath>
#include <string>

#include <tandem/lie/error.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/lie/sek3.hpp>
#include <tandem/residuals/residual.hpp>

namespace tandem {

/// Motion prior between two keyframes without measurements, for example in a gap of the inertial sensor: constant
/// velocity and orientation with white noise on acceleration and turn rate [m, m/s, rad],
///
///   e = [R_jᵀ (p_j − p_i − dt (v_i + v_j)/2);  R_jᵀ (v_j − v_i);  Log(R_iᵀ R_j)]
///
/// The rows are along the body axes at j, in the order of the first nine rows of PreintegratedImu. States: pose and
/// world velocity at i, then at j.
struct Coasting {
  static constexpr std::string_view name = "coasting";
  static constexpr int dim = 9;
  using States = std::tuple<SE3, R3, SE3, R3>;

  double dt;  ///< s, > 0

  auto fields() { return std::tie(dt); }

  template <Over<SE3> X, Over<R3> V>
  void operator()(const X& xi, const V& vi, const X& xj, const V& vj, Rows<9, X>& r, RowsBy<9, X>* Jxi = nullptr,
                  RowsBy<9, V>* Jvi = nullptr, RowsBy<9, X>* Jxj = nullptr, RowsBy<9, V>* Jvj = nullptr) const {
    using S = typename X::Scalar;
    using Rotation = BasicSO3<S>;
    using Square = Matrix<3, 3, S>;
    const S half(0.5 * dt);
    const Square to_body = xj.rotation().inverse().matrix();
    const Vector<3, S> p = to_body * (xj.translation() - xi.translation() - half * (vi.vector() + vj.vector()));
    const Vector<3, S> v = to_body * (vj.vector() - vi.vector());
    const Vector<3, S> theta = (xi.rotation().inverse() * xj.rotation()).Log();
    r << p, v, theta;
    if (Jxi) {
      Jxi->setZero();
      Jxi->template topLeftCorner<3, 3>().noalias() = -to_body * xi.rotation().matrix();
      Jxi->template bottomRightCorner<3, 3>() = -Rotation::Jl_inverse(theta);
    }
    if (Jxj) {
      *Jxj << Square::Identity(), skew(p), Square::Zero(), skew(v), Square::Zero(), Rotation::Jr_inverse(theta);
    }
    if (Jvi) *Jvi << -half * to_body, -to_body, Square::Zero();
    if (Jvj) *Jvj << -half * to_body, to_body, Square::Zero();
  }

  /// Returns the covariance diag(q dt³/12, q dt, w dt), three rows each. q [m²/s³] and w [rad²/s³] are the power
  /// spectral densities of acceleration and turn rate, equal on all axes. Because the position row uses the mean
  /// velocity, its noise is uncorrelated with that of the velocity row. Throws Error if dt or a density is not positive
  /// and finite.
  static Matrix<9, 9> covariance(double acceleration_density, double turn_rate_density, double dt) {
    if (!(dt > 0.0) || !std::isfinite(dt)) throw BadInputError(std::string(name) + ": dt must be positive and finite");
    for (const double density : {acceleration_density, turn_rate_density})
      if (!(density > 0.0) || !std::isfinite(density))
        throw BadInputError(std::string(name) + ": spectral densities must be positive and finite");
    Vector<9> diagonal;
    diagonal << Vector<3>::Constant(acceleration_density * dt * dt * dt / 12.0),
        Vector<3>::Constant(acceleration_density * dt), Vector<3>::Constant(turn_rate_density * dt);
    return diagonal.asDiagonal();
  }
};

}  // namespace tandem
