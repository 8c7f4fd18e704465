#pragma once

#include <tandem/problem/stop.hpp>
#include <tandem/solvers/online/online_estimator.hpp>

namespace tandem {

/// Feeds an estimator with all recorded samples and measurements up to time `until` [s], in the order of their stamps,
/// and calls finish(). Ends early on a stop request.
void replay(const NavigationData& data, double until, OnlineEstimator& estimator, const Stop& stop = {});

/// Returns the settings for the constructor of an estimator that replay() feeds: `data` without samples, measurements
/// and systematic errors.
NavigationData online_settings(const NavigationData& data);

/// Aligns the chaser by the first `seconds` of `data`. If the coarse alignment leaves the heading unknown, estimates
/// these seconds from several headings and returns the one with the lowest cost. After a stop, returns the best so far.
Alignment align(const NavigationData& data, double seconds, const OnlineOptions& options, const Stop& stop = {});

}  // namespace tandem
