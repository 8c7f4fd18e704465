#pragma once

#include <tandem/studies/study/trial.hpp>

namespace tandem {

/// Simulates the rendezvous of a REMUS 100 with the method of settings.rendezvous and the seed of settings.docking. A
/// complete run has the status converged, docked or not.
void run_rendezvous_trial(const TrialSettings& settings, const std::atomic<bool>* stop, TrialResult& result);

}  // namespace tandem
