#pragma once

#include <limits>
#include <optional>
#include <vector>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/residuals/loss.hpp>
#include <tandem/studies/planning/rendezvous.hpp>
#include <tandem/studies/simulation/simulate_dive.hpp>
#include <tandem/studies/simulation/simulate_docking.hpp>
#include <tandem/studies/support/named_parameter.hpp>

namespace tandem {

/// What tells the newest state, online.
struct NewestBy {
  enum class Kind {
    window,      ///< the smoother's window
    hypotheses,  ///< MotionHypotheses over the window, as `tandem track` does
    kalman       ///< ConstantVelocityFilter, a baseline
  };
  Kind kind = Kind::window;
  double acceleration = 0.2;                                       ///< of ConstantVelocityFilter
  double velocity_time = std::numeric_limits<double>::infinity();  ///< likewise
};

/// What the trials of a study simulate.
enum class Simulated {
  docking,  ///< a chaser with odometry and its target, in space or in the plane; or a rendezvous
  dive,     ///< a chaser with sensors of its own, and its target where it has one
};
std::string_view name(Simulated simulated);

/// How a chaser's own sensors are used.
struct OwnSensorSettings {
  std::optional<std::string> without;             ///< one of them that is left out
  double imu_sigma_factor = 1;                    ///< on the noise that the estimator is told
  double dvl_sigma_factor = 1;                    ///< likewise
  bool dvl_scale = false, preintegrated = false;  ///< EgoOptions::dvl_scale, preintegrated_dvl
};

/// What is simulated, and how it is estimated, of one trial of a study.
struct TrialSettings {
  DockingOptions docking;   ///< its seed is the trial's
  DiveOptions dive;         ///< likewise; of the two, the study's simulation counts
  OwnSensorSettings own{};  ///< of a dive

  double twist_sigma_factor = 1;    ///< on the priors of the target's motion, constant_twist and constant_velocity
  double usbl_sigma_factor = 1;     ///< on the sigmas that the estimator is told
  double optical_sigma_factor = 1;  ///< likewise
  double max_keyframes = 0;         ///< the first ones only; 0: all
  double window = 0;                ///< s: fixed-lag smoothing, the newest state of each keyframe; 0: all data at once
  NewestBy newest{};                ///< of such a window
  bool calibrated = false;          ///< with noise calibrated on the trial's own measurements first
  double start_position = 0;        ///< m: σ along each axis by which the target's start is displaced, a wander
  double start_orientation = 0;     ///< deg: σ about each axis by which it is turned
  Loss loss{};                      ///< on relative measurements
  bool level = true;                ///< the prior of a level target, where the model holds it softly
  Junction junction = Junction::boundary;  ///< of Mode B
  bool graduated = false;                  ///< robust losses by graduated non-convexity

  std::optional<RendezvousMethod> rendezvous{};  ///< simulate one of these in the place of an estimate
  double chance = 0;                             ///< RendezvousOptions::chance
  double information = RendezvousOptions{}.information;
};

/// Those of the simulation, then of the estimator.
const std::vector<NamedParameter<TrialSettings>>& trial_parameters(Simulated simulated);

/// Whether it disturbs the start alone: trials that differ in such parameters solve the same problem.
bool is_of_the_start(const std::string& parameter);

}  // namespace tandem
