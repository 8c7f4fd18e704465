#pragma once

#include <vector>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/solvers/marginals.hpp>
#include <tandem/studies/scenario/states_at.hpp>

namespace tandem {

/// Appends the pairs of variables whose joint covariances states_at() needs.
void add_pairs_at(const std::vector<double>& times, const TrackingProblem& tracking, const TrackingData& data,
                  const TrackingOptions& options, std::vector<Marginals::Pair>& pairs);

/// Returns the states of a tracking problem at these times, in this order, with covariances unless `marginals` is null.
/// A time outside the keyframes has a note instead of a state. Throws Stopped if `stop` requests it.
std::vector<StateAt> states_at(const std::vector<double>& times, const TrackingProblem& tracking,
                               const TrackingData& data, const TrackingOptions& options, const Marginals* marginals,
                               const Stop& stop = {});

}  // namespace tandem
