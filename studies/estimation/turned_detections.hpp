#pragma once

#include <string>

#include <tandem/problem/tracking/tracking_problem.hpp>

namespace tandem {

/// Finds a flipped detection: detectors of cars and vessels may confuse bow and stern. Searches for two consecutive
/// used poses of a sensor, at most 5 s apart, that differ by more than 150°. Returns for example "camera turns by 178
/// deg between 12.2 s and 12.4 s" for the first such pair, else an empty string. Chaser poses are those of the problem.
std::string turned_detections(const TrackingData& data, const TrackingProblem& tracking);

}  // namespace tandem
