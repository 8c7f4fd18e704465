#pragma once

#include <cmath>

#include <tandem/lie/rn.hpp>
#include <tandem/lie/se2.hpp>
#include <tandem/lie/sek3.hpp>

namespace tandem {

// Conversions between space and plane. Planar problems use the xy-plane; files, reports and plots are in space.
// `in_space` converts a planar pose or point to space. `in_group<G>` drops z, roll and pitch if G is planar.

inline const SE3& in_space(const SE3& x) { return x; }
inline SE3 in_space(const SE2& x) {
  return SE3(SO3::Exp({0, 0, x.rotation().angle()}), Vector<3>(x.translation().x(), x.translation().y(), 0));
}
inline Vector<3> in_space(const R3& x) { return x.vector(); }
inline Vector<3> in_space(const R2& x) { return {x.vector().x(), x.vector().y(), 0}; }

/// Returns the heading in (−π, π], about the world's z from its x axis [rad].
inline double heading(const SO3& R) {
  const Matrix<3, 3> m = R.matrix();
  return std::atan2(m(1, 0), m(0, 0));
}

template <class G>
auto in_group(const SO3& R) {
  if constexpr (std::same_as<G, SE2>) {
    return SO2(heading(R));
  } else {
    return R;
  }
}
template <class G>
Vector<G::point_dim> in_group(const Vector<3>& p) {
  return p.template head<G::point_dim>();
}
template <class G>
G in_group(const SE3& x) {
  return G(in_group<G>(x.rotation()), in_group<G>(x.translation()));
}

}  // namespace tandem
