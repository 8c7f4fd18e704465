#pragma once

#include <Eigen/LU>

#include <tandem/studies/live/track_report.hpp>

namespace tandem::bench {

/// A textbook filter that online tracking has to beat, and its setting.
struct ConstantVelocityFilter {
  double q;    ///< white acceleration along x and y [m s^-3/2]; 0.03 along z
  double tau;  ///< s: in which the velocity is forgotten, or infinite

  /// Mean errors [m] of the target's newest position relative to the chaser at usbl, optical and gated keyframes, then of
  /// predictions `ahead` seconds ahead at all of them: a Kalman filter of the target's world position and velocity, seen
  /// from the dead-reckoned chaser, its fixes as positions.
  std::vector<double> errors(const Scenario& scenario, const std::vector<double>& ahead) const {
    std::vector<Moments> moments(3 + ahead.size());
    Vector<6> x;
    Matrix<6, 6> P;
    double last = 0;
    bool started = false;
    for (const Keyframe& k : make_keyframes(scenario.data, 0)) {
      const SE3 chaser = pose_at(scenario.data.odometry, k.t).value(),
                truth = pose_at(scenario.truth_chaser, k.t).value();
      if (!started) {
        if (!k.measured_position) continue;
        x << chaser.act(*k.measured_position), Vector<3>::Zero();
        P = Vector<6>(9, 9, 9, 1, 1, 0.01).asDiagonal();
        started = true;
        last = k.t;
        continue;
      }
      predict(x, P, k.t - last);
      last = k.t;
      if (k.measured_position) {
        const double sigma = k.type == KeyframeType::optical ? 0.13 : 1.72;
        const Matrix<6, 3> K =
            P.leftCols<3>() *
            Matrix<3, 3>(P.topLeftCorner<3, 3>() + sigma * sigma * Matrix<3, 3>::Identity()).inverse();
        x += K * (chaser.act(*k.measured_position) - x.head<3>());
        P -= (K * P.topRows<3>()).eval();
      }
      const auto add = [&](Moments& to, double h) {
        const auto there = pose_at(scenario.truth_target, k.t + h);
        if (!there) return;
        const Vector<3> seen = chaser.inverse().act(x.head<3>() + way(h) * x.tail<3>());
        to.add((seen - truth.inverse().act(there->translation())).norm());
      };
      add(moments[k.type == KeyframeType::usbl ? 0 : k.type == KeyframeType::optical ? 1 : 2], 0);
      for (std::size_t i = 0; i < ahead.size(); ++i) add(moments[3 + i], ahead[i]);
    }
    std::vector<double> means;
    for (const Moments& m : moments) means.push_back(m.spread() ? m.spread()->mean : NAN);
    return means;
  }

 private:
  double way(double t) const { return std::isinf(tau) ? t : -tau * std::expm1(-t / tau); }
  void predict(Vector<6>& x, Matrix<6, 6>& P, double dt) const {
    Matrix<6, 6> F = Matrix<6, 6>::Identity();
    F.topRightCorner<3, 3>().diagonal().setConstant(way(dt));
    F.bottomRightCorner<3, 3>().diagonal().setConstant(std::exp(-dt / tau));
    const Matrix<3, 3> Q = Vector<3>(q * q, q * q, 0.03 * 0.03).asDiagonal();
    x = (F * x).eval();
    P = (F * P * F.transpose()).eval();
    P.topLeftCorner<3, 3>() += dt * dt * dt / 3 * Q;
    P.topRightCorner<3, 3>() += dt * dt / 2 * Q;
    P.bottomLeftCorner<3, 3>() += dt * dt / 2 * Q;
    P.bottomRightCorner<3, 3>() += dt * Q;
  }
};

}  // namespace tandem::bench
