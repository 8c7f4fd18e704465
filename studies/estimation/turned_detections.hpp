#pragma once

#include <string>

#include <tandem/problem/tracking/tracking_problem.hpp>

namespace tandem {

/// "camera turns by 178 deg between 12.2 s and 12.4 s": the first two poses in a row, no more than 5 s apart, of which one
/// must be turned round, as detectors of cars and vessels confuse bow and stern. Chaser poses are the problem's. Empty
/// where there are none.
std::string turned_detections(const TrackingData& data, const TrackingProblem& tracking);

}  // namespace tandem
