#pragma once

// Operations that most sources use. Clang instantiates them once, when it precompiles this header, instead of in every
// source. The functions are never called.

#include <Eigen/Core>
#include <Eigen/LU>

#include <tandem/lie/operations.hpp>
#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/se3.hpp>

namespace tandem::detail {

template <LieGroup G>
void use_group(const G& x, const typename G::Tangent& v, const Vector<G::point_dim>& p) {
  typename G::Jacobian J, K;
  minus(x, x, &J, &K);
  plus(x, v, &J, &K);
  interpolate(x, x, 0.5, &J, &K);
  J = multiply<G>(K, x.Ad()) * K.transpose() - G::Jl(v);
  Matrix<G::point_dim, G::dof> A = x.act_point_jacobian() * x.act_jacobian(p);
  A.noalias() = A * J;
  static_cast<void>((x.act(p) - p).norm() + p.dot(p) + G::angle(-v));
}

inline void use_common_operations() {
  use_group<SE3>({}, {}, {});
  use_group<SE2>({}, {}, {});
  use_group<SO3>({}, {}, {});
  use_group<SO2>({}, {}, {});
  use_group<Rn<1>>({}, {}, {});
  use_group<Rn<2>>({}, {}, {});
  use_group<Rn<3>>({}, {}, {});
  use_group<Rn<6>>({}, {}, {});
  Eigen::MatrixXd A(6, 6);
  Eigen::VectorXd b(6);
  A.noalias() += A.transpose() * A.middleCols(0, 6);
  b.noalias() -= A * b.segment(0, 6) + A.transpose() * b;
  b.head(3) = A.block(0, 0, 3, 6) * b;
  A.diagonal() += b.cwiseAbs2();
  A = b.asDiagonal() * A;
  static_cast<void>(b.squaredNorm() + b.norm() + b.dot(A.col(0)) + b.cwiseAbs().maxCoeff());
}

}  // namespace tandem::detail
