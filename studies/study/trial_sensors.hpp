#pragma once

#include <string>
#include <vector>

#include <tandem/studies/study/trial_settings.hpp>

namespace tandem {

/// A sensor of a trial.
struct TrialSensor {
  std::string name;
  int rows;  ///< number of residual rows, which is the expected mean of its NIS
};

/// Returns the sensors that a trial simulates: those that observe the target, then the chaser's own without the IMU.
std::vector<TrialSensor> trial_sensors(const TrialSettings& settings, Simulated simulated);

/// Returns the names of the sensors of all kinds of trials, each once.
std::vector<std::string> all_trial_sensors();

/// Returns the metric of a sensor's NIS: "nis_NAME".
std::string nis_metric(const std::string& sensor);

}  // namespace tandem
