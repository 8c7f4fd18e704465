#pragma once

#include <tandem/lie/types.hpp>

namespace tandem {

/// Returns the standard deviations of a pose: `linear` for each translation [m], `angular` for each rotation [rad].
inline Vector<6> pose_sigmas(double linear, double angular) {
  return (Vector<6>() << Vector<3>::Constant(linear), Vector<3>::Constant(angular)).finished();
}

}  // namespace tandem
