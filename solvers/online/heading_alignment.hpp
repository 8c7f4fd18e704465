#pragma once

#include <tandem/problem/stop.hpp>
#include <tandem/solvers/online/online_estimator.hpp>

namespace tandem {

/// Gives an estimator all that was recorded up to a time [s], in the order in which it came, and
/// finishes it. It ends early when it is to stop.
void replay(const NavigationData& data, double until, OnlineEstimator& estimator, const Stop& stop = {});

/// What replay() of `data` gives an estimator's constructor: its settings, without errors that stay, of which a
/// first guess has none, and without what is not read there.
NavigationData online_settings(const NavigationData& data);

/// The alignment of `data`'s first `seconds`: coarse, and where that leaves the heading open, the best of several
/// headings by the cost of estimating these seconds from each; the best of those tried when it is to stop.
Alignment align(const NavigationData& data, double seconds, const OnlineOptions& options, const Stop& stop = {});

}  // namespace tandem
