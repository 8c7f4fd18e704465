#pragma once

#include <array>

#include <ceres/ceres.h>

#include <tandem/problem/problem.hpp>

namespace tandem::bench {

/// Parameter block of an SE(3) pose in Ceres: qx qy qz qw x y z.
using CeresPose = std::array<double, 7>;

inline CeresPose to_ceres(const SE3& x) {
  const auto& q = x.rotation().quaternion();
  const Vector<3> t = x.translation();
  return {q.x(), q.y(), q.z(), q.w(), t[0], t[1], t[2]};
}
inline SE3 from_ceres(const double* p) {
  return SE3(SO3(Eigen::Quaterniond(p[3], p[0], p[1], p[2])), Vector<3>(p[4], p[5], p[6]));
}

/// Manifold with the retraction X ⊕ δ, so that both solvers take the same steps. Jacobians are in tangent coordinates:
/// the first six of the seven columns are ∂/∂δ, and PlusJacobian selects them.
class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* y) const override {
    const CeresPose moved = to_ceres(from_ceres(x) * SE3::Exp(Eigen::Map<const Vector<6>>(delta)));
    std::copy(moved.begin(), moved.end(), y);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
  bool Minus(const double* y, const double* x, double* delta) const override {
    Eigen::Map<Vector<6>>(delta).noalias() = (from_ceres(x).inverse() * from_ceres(y)).Log();
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
};

/// Ceres cost function that evaluates a whitened Tandem residual over poses.
template <Residual R>
class ResidualCost final : public ceres::CostFunction {
  static constexpr int kArity = std::tuple_size_v<typename R::States>;

 public:
  ResidualCost(const R& residual, const Gaussian& noise) : residual_(residual), weight_(noise.diagonal()) {
    set_num_residuals(R::dim);
    mutable_parameter_block_sizes()->assign(kArity, 7);
  }

  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    std::array<SE3, kArity> states;
    for (std::size_t s = 0; s < kArity; ++s) states[s] = from_ceres(x[s]);
    std::array<Matrix<R::dim, 6>, kArity> J;
    Vector<R::dim> r;
    [&]<std::size_t... S>(std::index_sequence<S...>) {
      residual_(states[S]..., r, (jacobians && jacobians[S] ? &J[S] : nullptr)...);
    }
    (std::make_index_sequence<kArity>{});
    Eigen::Map<Vector<R::dim>>(residuals).noalias() = weight_.cwiseProduct(r);
    for (std::size_t s = 0; jacobians && s < kArity; ++s) {
      if (!jacobians[s]) continue;
      Eigen::Map<Eigen::Matrix<double, R::dim, 7, Eigen::RowMajor>> out(jacobians[s]);
      out.template leftCols<6>() = weight_.asDiagonal() * J[s];
      out.col(6).setZero();
    }
    return true;
  }

 private:
  R residual_;
  Vector<R::dim> weight_;
};

}  // namespace tandem::bench
