#pragma once

#include <tandem/lie/types.hpp>

namespace tandem {

/// A standard deviation of each linear component of a pose, and one of each angular one.
inline Vector<6> pose_sigmas(double linear, double angular) {
  return (Vector<6>() << Vector<3>::Constant(linear), Vector<3>::Constant(angular)).finished();
}

}  // namespace tandem
