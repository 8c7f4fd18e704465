#pragma once

#include <random>

#include <tandem/studies/scenario/scenario.hpp>
#include <tandem/studies/simulation/simulate_dive_files.hpp>

#include "studies/scratch.hpp"

namespace tandem {

/// Returns the pose of a surface vessel that a diving vehicle measures by USBL; t [s].
inline SE3 vessel_at(double t) {
  return SE3(SO3::Exp({0, 0, 0.3}), Vector<3>(15, -8, 0)) *
         SE3::Exp((Vector<6>() << 1.3, 0, 0, 0, 0, 0.01).finished() * t);
}

/// Returns a simulated dive as a scenario with a USBL fix of the vessel every 2 s. `sigma`: noise of the fixes along
/// each axis [m]. With sigma = 0 the fixes are exact and their stated standard deviation is 0.1 m.
inline Scenario dive_with_target(const DiveOptions& options, double sigma) {
  SimulatedDive dive = simulate_dive(options);
  Scenario scenario;
  scenario.name = "dive with a target";
  for (const auto& [t, state] : dive.truth) {
    scenario.truth_chaser.push_back({t, SE3(state.rotation(), state.translation())});
    scenario.truth_target.push_back({t, vessel_at(t)});
  }
  TargetSensor usbl{.name = "usbl", .type = SensorType::position};
  usbl.sigma = Vector<3>::Constant(sigma > 0 ? sigma : 0.1);
  std::mt19937_64 random(options.seed);
  std::normal_distribution<double> normal;
  for (std::size_t k = 13; k < dive.truth.size(); k += 20) {
    const auto& [t, chaser] = scenario.truth_chaser[k];
    const Vector<3> e{normal(random), normal(random), normal(random)};
    usbl.measurements.push_back({.t = t, .position = chaser.inverse().act(vessel_at(t).translation()) + sigma * e});
  }
  scenario.data.sensors = {usbl};
  scenario.data.noise.constant_twist = Vector<6>(0.02, 0.02, 0.02, 0.005, 0.005, 0.005);
  scenario.data.noise.constant_velocity.setConstant(0.05);
  scenario.navigation = std::move(dive.data);
  return scenario;
}

/// Adds the target's fixes, truth and noise to a folder that write_dive() wrote.
inline void write_target_of_dive(const Scenario& scenario, const std::filesystem::path& folder) {
  std::ofstream usbl(folder / "usbl.csv"), truth(folder / "truth_target.tum"),
      yaml(folder / "scenario.yaml", std::ios::app);
  usbl.precision(12);
  usbl << "t,x,y,z\n";
  for (const Measurement& m : scenario.data.sensors[0].measurements)
    usbl << m.t << ',' << m.position.x() << ',' << m.position.y() << ',' << m.position.z() << '\n';
  truth.precision(12);
  for (const auto& [t, pose] : scenario.truth_target)
    truth << t << ' ' << pose.translation().transpose() << ' ' << pose.rotation().quaternion().coeffs().transpose()
          << '\n';
  yaml << "noise:\n  usbl: [0.3, 0.3, 0.3]\n  constant_twist: [0.02, 0.02, 0.02, 0.005, 0.005, 0.005]\n";
}

}  // namespace tandem
