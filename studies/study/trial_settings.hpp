#pragma once

#include <limits>
#include <optional>
#include <vector>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/residuals/loss.hpp>
#include <tandem/studies/rendezvous/rendezvous.hpp>
#include <tandem/studies/simulation/simulate_dive.hpp>
#include <tandem/studies/simulation/simulate_docking.hpp>
#include <tandem/studies/support/named_parameter.hpp>

namespace tandem {

/// Method that estimates the newest target state online.
struct NewestStateMethod {
  enum class Kind {
    window,      ///< the window of the fixed-lag smoother
    hypotheses,  ///< MotionHypotheses over the window, as in `tandem track`
    kalman       ///< ConstantVelocityFilter, the baseline
  };
  Kind kind = Kind::window;
  double acceleration = 0.2;                                       ///< parameter of ConstantVelocityFilter
  double velocity_time = std::numeric_limits<double>::infinity();  ///< parameter of ConstantVelocityFilter
};

/// Type of simulation of a study's trials.
enum class Simulated {
  docking,  ///< a chaser with odometry and its target, in space or in the plane; or a rendezvous
  dive,     ///< a chaser with its own sensors, with or without a target
};
std::string_view name(Simulated simulated);

/// Settings of the chaser's own sensors.
struct OwnSensorSettings {
  std::optional<std::string> without;             ///< sensor that the estimator does not use
  double imu_sigma_factor = 1;                    ///< factor on the IMU noise that the estimator assumes
  double dvl_sigma_factor = 1;                    ///< factor on the DVL sigmas that the estimator assumes
  bool dvl_scale = false, preintegrated = false;  ///< EgoOptions::dvl_scale, preintegrated_dvl
};

/// Simulation and estimation settings of one trial.
struct TrialSettings {
  DockingOptions docking;   ///< used by Simulated::docking; holds the seed of the trial
  DiveOptions dive;         ///< used by Simulated::dive; holds the same seed
  OwnSensorSettings own{};  ///< used by Simulated::dive

  double twist_sigma_factor = 1;    ///< Factor on constant_twist and constant_velocity, the target's motion noise.
  double usbl_sigma_factor = 1;     ///< Factor on the USBL sigmas that the estimator assumes.
  double optical_sigma_factor = 1;  ///< Factor on the optical sigmas that the estimator assumes.
  double max_keyframes = 0;         ///< Use only the first keyframes; 0: all.
  double window = 0;                ///< Fixed-lag smoothing, errors of the newest states [s]; 0: batch estimate.
  NewestStateMethod newest{};       ///< Method for the newest state; needs a window.
  bool calibrated = false;          ///< Calibrate the noise on the trial's own measurements first.
  double start_position = 0;        ///< Displacement of the target's initial guess: σ along each axis [m].
  double start_orientation = 0;     ///< Rotation of the target's initial guess: σ about each axis [deg].
  Loss loss{};                      ///< Robust loss of relative measurements.
  bool level = true;                ///< Use the soft prior of a level target.
  Junction junction = Junction::boundary;  ///< Connection of points and poses in Mode B.
  bool graduated = false;                  ///< Solve robust losses by graduated non-convexity.

  std::optional<RendezvousMethod> rendezvous{};  ///< simulate a rendezvous instead of an estimate
  double chance = 0;                             ///< RendezvousOptions::chance
  double information = RendezvousOptions{}.information;
};

/// Returns the parameters of the simulation, then those of the estimator.
const std::vector<NamedParameter<TrialSettings>>& trial_parameters(Simulated simulated);

/// Returns whether a parameter only disturbs the initial guess. Trials that differ only in such parameters solve the
/// same problem.
bool is_initial_guess_parameter(const std::string& parameter);

}  // namespace tandem
