#pragma once

#include <memory>
#include <vector>

#include <tandem/problem/tracking/tracking_initial_guess.hpp>
#include <tandem/residuals/constant_twist.hpp>
#include <tandem/residuals/prior.hpp>
#include <tandem/residuals/relative_pose.hpp>
#include <tandem/residuals/roll_pitch.hpp>
#include <tandem/residuals/usbl_position.hpp>

#include "ceres_adapter.hpp"

namespace tandem::bench {

/// Mode A with the soft roll-pitch prior as a Ceres problem, with the residuals, noise and initial guess of
/// make_tracking_problem().
class ModeACeres {
 public:
  explicit ModeACeres(const TrackingData& data) {
    const auto frames = make_keyframes(data);
    const auto odometry = odometry_at(data.odometry, frames);
    const auto target = initial_target_guess(data, frames, odometry).pose;
    start_.reserve(2 * frames.size());
    for (std::size_t k = 0; k < frames.size(); ++k) {
      start_.push_back(to_ceres(odometry[k]));
      start_.push_back(to_ceres(target[k]));
    }
    poses_ = start_;
    for (auto& pose : poses_) problem_.AddParameterBlock(pose.data(), 7, new PoseManifold);

    const auto dt = [&](std::size_t k) { return frames[k].t - frames[k - 1].t; };
    const auto& noise = data.noise;
    add(Prior<SE3>{odometry[0]}, Gaussian(noise.prior), {c(0)});
    for (std::size_t k = 1; k < frames.size(); ++k)
      add(RelativePose<SE3>{odometry[k - 1].inverse() * odometry[k]}, Gaussian(noise.odometry).scaled(std::sqrt(dt(k))),
          {c(k - 1), c(k)});
    for (const auto& sensor : data.sensors)
      for (const auto& m : sensor.measurements) {
        const std::size_t k = keyframe_at(frames, m.t).value();
        const Gaussian sigma(sensor.sigma);
        if (sensor.type == SensorType::pose)
          add(RelativePose<SE3>{SE3(m.rotation, m.position), sensor.mount, sensor.marker}, sigma, {c(k), t(k)});
        else
          add(UsblPosition<SE3>{m.position, sensor.mount, sensor.marker.translation()}, sigma, {c(k), t(k)});
      }
    for (std::size_t k = 2; k < frames.size(); ++k)
      add(ConstantTwist<SE3>{dt(k - 1), dt(k)}, Gaussian(noise.constant_twist).scaled(std::sqrt(dt(k))),
          {t(k - 2), t(k - 1), t(k)});
    for (std::size_t k = 0; k < frames.size(); ++k) add(RollPitch<SE3>{}, Gaussian(noise.roll_pitch), {t(k)});
  }

  ceres::Problem& problem() { return problem_; }
  void reset() { std::copy(start_.begin(), start_.end(), poses_.begin()); }

 private:
  double* c(std::size_t k) { return poses_[2 * k].data(); }
  double* t(std::size_t k) { return poses_[2 * k + 1].data(); }

  template <Residual R>
  void add(const R& residual, const Gaussian& noise, const std::vector<double*>& poses) {
    problem_.AddResidualBlock(new ResidualCost<R>(residual, noise), nullptr, poses);
  }

  std::vector<CeresPose> start_, poses_;
  ceres::Problem problem_;
};

}  // namespace tandem::bench
