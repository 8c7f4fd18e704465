#pragma once

#include <tandem/studies/study/trial.hpp>

namespace tandem {

/// Simulates the rendezvous of a REMUS 100 that the settings ask for, by the docking's seed; converged is what ran to its
/// end, docked or not.
void run_rendezvous_trial(const TrialSettings& settings, const std::atomic<bool>* stop, TrialResult& result);

}  // namespace tandem
