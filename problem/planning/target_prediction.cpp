#include <tandem/lie/error.hpp>
#include <tandem/problem/planning/target_prediction.hpp>
#include <tandem/residuals/constant_twist.hpp>

namespace tandem {

TargetPrediction predict_target(const TargetBelief& belief, const Vector<6>& noise, double dt, int steps) {
  if (!(belief.dt > 0) || !(dt > 0)) throw Error("a target's prediction needs times that are positive");
  TargetPrediction p;
  SE3 before = belief.before, now = belief.now;
  Matrix<12, 12> both = belief.covariance;
  double last = belief.dt;
  const Vector<6> twist = (before.inverse() * now).Log() / last;
  const auto add = [&] {
    p.pose.push_back(now);
    p.twist.push_back(twist);
    p.covariance.push_back(both.bottomRightCorner<6, 6>());
  };
  add();
  for (int k = 0; k < steps; ++k) {
    const SE3 next = now * SE3::Exp(dt * twist);
    Vector<6> e;
    Matrix<6, 6> J0, J1;
    ConstantTwist<SE3>{last, dt}(before, now, next, e, &J0, &J1);  // its Jacobian by `next` is I where e vanishes
    Matrix<12, 12> step = Matrix<12, 12>::Zero();
    step.topRightCorner<6, 6>().setIdentity();
    step.bottomLeftCorner<6, 6>() = -J0;
    step.bottomRightCorner<6, 6>() = -J1;
    both = (step * both * step.transpose()).eval();
    both.bottomRightCorner<6, 6>().diagonal() += dt * noise.cwiseAbs2();
    before = now;
    now = next;
    last = dt;
    add();
  }
  return p;
}

}  // namespace tandem
