#include <algorithm>
#include <cmath>

#include <tandem/lie/wrapped_angle.hpp>
#include <tandem/problem/planning/discretisation_error.hpp>

namespace tandem {
namespace {

constexpr int kFirstParts = 32, kMaxParts = 1024;  // short steps per step of the plan
constexpr double kChange = 0.01;                   // relative change of the error at which short steps are short enough
constexpr double kPosition = 1e-4, kHeading = 1e-5;  // errors that count as zero [m, rad]

double heading_difference(const SE3& a, const SE3& b) {
  const Matrix<3, 3> A = a.rotation().matrix(), B = b.rotation().matrix();
  return std::abs(wrapped_angle(std::atan2(A(1, 0), A(0, 0)) - std::atan2(B(1, 0), B(0, 0))));
}

template <int N>
DiscretisationError error_with_parts(const VehicleModel<N>& vehicle, const Plan<N>& plan, double dt,
                                     const Vector<3>& current, int parts) {
  const VehicleStep<N> step(vehicle, dt / parts);
  VehicleState<N> state = plan.states.front();
  DiscretisationError worst;
  for (std::size_t k = 0; k < plan.commands.size(); ++k) {
    for (int part = 0; part < parts; ++part) state = step.or_constant_twist(state, plan.commands[k], current);
    const SE3& planned = plan.states[k + 1].pose;
    worst.position = std::max(worst.position, (state.pose.translation() - planned.translation()).norm());
    worst.heading = std::max(worst.heading, heading_difference(state.pose, planned));
  }
  return worst;
}

bool close(double a, double b, double zero) { return std::abs(a - b) <= kChange * std::max(a, b) + zero; }

}  // namespace

template <int N>
DiscretisationError discretisation_error(const VehicleModel<N>& vehicle, const Plan<N>& plan, double dt,
                                         const Vector<3>& current) {
  DiscretisationError error = error_with_parts(vehicle, plan, dt, current, kFirstParts);
  for (int parts = 2 * kFirstParts; parts <= kMaxParts; parts *= 2) {
    const DiscretisationError before = error;
    error = error_with_parts(vehicle, plan, dt, current, parts);
    if (close(error.position, before.position, kPosition) && close(error.heading, before.heading, kHeading)) break;
  }
  return error;
}

template DiscretisationError discretisation_error(const VehicleModel<3>&, const Plan<3>&, double, const Vector<3>&);
template DiscretisationError discretisation_error(const VehicleModel<8>&, const Plan<8>&, double, const Vector<3>&);

}  // namespace tandem
