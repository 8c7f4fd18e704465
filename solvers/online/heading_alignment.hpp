#pragma once

#include <tandem/solvers/online/online_estimator.hpp>

namespace tandem {

/// Gives an estimator all that was recorded up to a time [s], in the order in which it came, and
/// finishes it.
void replay(const NavigationData& data, double until, OnlineEstimator& estimator);

/// What replay() of `data` gives an estimator's constructor: its settings, without errors that stay, which are of whole
/// recordings, and without what is not read there.
NavigationData online_settings(const NavigationData& data);

/// The alignment of `data`'s first `seconds`: coarse, and where that leaves the heading open, the best of several
/// headings by the cost of estimating these seconds from each.
Alignment align(const NavigationData& data, double seconds, const OnlineOptions& options);

}  // namespace tandem
