#include <Eigen/LU>

#include <tandem/lie/error.hpp>
#include <tandem/problem/planning/target_prediction.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/damped_twist.hpp>

namespace tandem {
namespace {

/// A step of the motion: its Jacobians by the two poses before it (that by the next is I where the residual vanishes),
/// and the standard deviations of its noise.
struct MotionStep {
  Matrix<6, 6> J0, J1;
  Vector<6> sigma;
};

template <class Motion>
void linearize(const Motion& motion, const SE3& before, const SE3& now, const SE3& next, MotionStep& step) {
  Vector<6> e;
  motion(before, now, next, e, &step.J0, &step.J1);
}

/// (S⁻¹ + Eᵀ Λ E)⁻¹ of the two poses' covariance S, E the newer one's: Λ need not be regular.
void take_in(const Matrix<6, 6>& information, Matrix<12, 12>& both) {
  const Matrix<12, 6> by_now = both.rightCols<6>();
  const Matrix<6, 6> gain = Matrix<6, 6>::Identity() + Matrix<6, 6>(information * by_now.bottomRows<6>());
  const Matrix<6, 6> kept = gain.partialPivLu().solve(information);
  both -= (by_now * kept * by_now.transpose()).eval();
  both = (0.5 * (both + both.transpose())).eval();
}

}  // namespace

TargetPrediction predict_target(const TargetBelief& belief, const Vector<6>& noise, double dt, int steps,
                                const std::optional<Vector<6>>& time_constants,
                                const std::vector<Matrix<6, 6>>& fixes) {
  if (!fixes.empty() && fixes.size() != std::size_t(steps))
    throw Error("a target's prediction needs a fix for each step");
  if (!(belief.dt > 0) || !(dt > 0)) throw Error("a target's prediction needs times that are positive");
  if (time_constants && !(time_constants->array() > 0).all())
    throw Error("a target's prediction needs time constants that are positive");
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
  for (int k = 0; k < steps; ++k) {
    MotionStep step{{}, {}, std::sqrt(dt) * noise};
    if (time_constants) {
      const auto damped = DampedTwist<SE3>::over(last, dt, *time_constants);
      step.sigma = noise.cwiseProduct(DampedTwist<SE3>::spread(last, dt, *time_constants));
      twist = twist.cwiseProduct(damped.kept).eval();
      linearize(damped, before, now, now * SE3::Exp(dt * twist), step);
    } else {
      linearize(ConstantTwist<SE3>{last, dt}, before, now, now * SE3::Exp(dt * twist), step);
    }
    const SE3 next = now * SE3::Exp(dt * twist);
    Matrix<12, 12> carried = Matrix<12, 12>::Zero();
    carried.topRightCorner<6, 6>().setIdentity();
    carried.bottomLeftCorner<6, 6>() = -step.J0;
    carried.bottomRightCorner<6, 6>() = -step.J1;
    both = (carried * both * carried.transpose()).eval();
    both.bottomRightCorner<6, 6>().diagonal() += step.sigma.cwiseAbs2();
    if (!fixes.empty()) take_in(fixes[std::size_t(k)], both);
    before = now;
    now = next;
    last = dt;
    add();
  }
  return p;
}

}  // namespace tandem
