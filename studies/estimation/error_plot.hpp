#pragma once

#include <string>

#include <tandem/studies/estimation/estimate.hpp>
#include <tandem/studies/support/figure.hpp>

namespace tandem {

/// gnuplot: the relative pose's signed errors by component over time, within their ±3 σ bands; without truth the bands
/// alone. Empty where there is neither. Baxter & Teran Espinoza 2025, fig. 7.
std::string error_bands_script(const Estimate& estimate, PlotFormat format);

/// gnuplot: position and orientation error of each keyframe, whatever their direction. Empty without truth.
std::string error_norms_script(const Estimate& estimate, PlotFormat format);

}  // namespace tandem
