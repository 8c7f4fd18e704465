#pragma once

#include <vector>

#include <tandem/solvers/calibration/select_model.hpp>
#include <tandem/studies/calibration/misfit.hpp>
#include <tandem/studies/estimation/estimate.hpp>

namespace tandem {

/// Returns candidate changes for a recording, with the reasons that its residuals give: losses, systematic errors of
/// each sensor, motion models of the target, and noise. `scenario` and `options` have the settings of the given model;
/// `residuals` are those at its solution.
std::vector<ModelChange> proposed_changes(const Scenario& scenario, const TrackingOptions& options,
                                          const std::vector<Misfit>& residuals);

/// Returns other values for the numbers of a model: its systematic errors and their correlation times, and all noise,
/// larger and smaller. `scenario` has the settings of the model.
std::vector<ModelChange> refined_changes(const Scenario& scenario, const TrackingOptions& options,
                                         const ModelSettings& settings);

/// Returns whether noise and bias of each sensor together have at least half of the variance that the user states.
/// Slow errors of a sensor are not observable if it is alone, because the motion of the target explains them: the
/// stated noise is all that is known of them. `scenario` has the settings of the model, `stated` those of the user.
bool keeps_stated_noise(const Scenario& stated, const Scenario& scenario);

}  // namespace tandem
