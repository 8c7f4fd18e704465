#include <Eigen/LU>

#include <tandem/lie/error.hpp>
#include <tandem/problem/planning/target_prediction.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/damped_twist.hpp>

namespace tandem {
namespace {

/// Adds the information Λ on the newer of two poses to their joint covariance S: S ← (S⁻¹ + Eᵀ Λ E)⁻¹. Λ may be
/// singular.
void add_information(const Matrix<6, 6>& information, Matrix<12, 12>& both) {
  const Matrix<12, 6> by_now = both.rightCols<6>();
  const Matrix<6, 6> gain = Matrix<6, 6>::Identity() + Matrix<6, 6>(information * by_now.bottomRows<6>());
  const Matrix<6, 6> correction = gain.partialPivLu().solve(information);
  both -= (by_now * correction * by_now.transpose()).eval();
  both = (0.5 * (both + both.transpose())).eval();
}

}  // namespace

TargetPrediction predict_target(const TargetBelief& belief, const Vector<6>& noise, double dt, int steps,
                                const std::optional<Vector<6>>& time_constants,
                                const std::vector<Matrix<6, 6>>& fixes) {
  if (!fixes.empty() && fixes.size() != std::size_t(steps))
    throw BadInputError("predict_target: the number of fixes must be 0 or the number of steps");
  if (!(belief.dt > 0) || !(dt > 0))
    throw BadInputError("predict_target: dt and the dt of the belief must be positive");
  if (time_constants && !(time_constants->array() > 0).all())
    throw BadInputError("predict_target: all time constants must be positive");
  if (!noise.allFinite() || (noise.array() < 0).any() || steps < 0)
    throw BadInputError("predict_target: noise and steps must not be negative");
  if (!belief.covariance.allFinite() || (belief.covariance.diagonal().array() < 0).any())
    throw BadInputError("predict_target: the covariance of the belief is not finite or has a negative variance");
  TargetPrediction p;
  SE3 before = belief.before, now = belief.now;
  Matrix<12, 12> both = belief.covariance;
  double last = belief.dt;
  Vector<6> twist = (before.inverse() * now).Log() / last;
  const auto add = [&] {
    p.pose.push_back(now);
    p.twist.push_back(twist);
    p.covariance.push_back(both.bottomRightCorner<6, 6>());
  };
  add();
  const auto move = [&](const auto& motion, const Vector<6>& sigma) {
    const SE3 next = now * SE3::Exp(dt * twist);
    Vector<6> e;
    Matrix<6, 6> J0, J1;  // the Jacobian with respect to `next` is I
    motion(before, now, next, e, &J0, &J1);
    Matrix<12, 12> transition = Matrix<12, 12>::Zero();
    transition.topRightCorner<6, 6>().setIdentity();
    transition.bottomLeftCorner<6, 6>() = -J0;
    transition.bottomRightCorner<6, 6>() = -J1;
    both = (transition * both * transition.transpose()).eval();
    both.bottomRightCorner<6, 6>().diagonal() += sigma.cwiseAbs2();
    before = now;
    now = next;
  };
  for (int k = 0; k < steps; ++k) {
    if (time_constants) {
      const auto damped = DampedTwist<SE3>::over(last, dt, *time_constants);
      twist = twist.cwiseProduct(damped.decay).eval();
      move(damped, noise.cwiseProduct(DampedTwist<SE3>::noise_scale(last, dt, *time_constants)));
    } else {
      move(ConstantTwist<SE3>{last, dt}, std::sqrt(dt) * noise);
    }
    if (!fixes.empty()) add_information(fixes[std::size_t(k)], both);
    last = dt;
    add();
  }
  return p;
}

}  // namespace tandem
