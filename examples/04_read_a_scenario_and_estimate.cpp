// A scenario folder, read and estimated: what `tandem estimate FOLDER` does, as a program of your own.
// Usage: 04_read_a_scenario_and_estimate FOLDER, e.g. share/tandem/scenarios/docking_a of the installation
#include <cstdio>
#include <exception>
#include <map>
#include <utility>

#include <tandem/problem/tracking/tracking_problem.hpp>
#include <tandem/solvers/gauss_newton.hpp>
#include <tandem/studies/scenario/scenario.hpp>

using namespace tandem;

int main(int argc, char** argv) try {
  if (argc != 2) {
    std::fprintf(stderr, "usage: %s FOLDER\n", argv[0]);
    return 1;
  }
  const Scenario scenario = read_scenario(argv[1]);  // an Error names file and line
  TrackingOptions options;
  options.non_holonomic = Role::soft;  // the target hardly moves sideways, or up and down
  TrackingProblem tracking = make_tracking_problem(scenario.data, options);
  const Summary summary = solve(tracking.problem, GaussNewtonOptions{});
  std::printf("%s: %zu keyframes, cost %.1f, %.3f s, %s\n", scenario.name.c_str(), tracking.keyframes.size(),
              summary.cost, summary.seconds, summary.message.c_str());

  // The target's place as the chaser sees it, against the truth, by what was measured at the keyframe.
  struct Mean {
    double sum = 0.0;
    int n = 0;
  };
  std::map<KeyframeType, Mean> errors;
  for (std::size_t k = 0; k < tracking.keyframes.size(); ++k) {
    const Keyframe& keyframe = tracking.keyframes[k];
    const auto chaser = pose_at(scenario.truth_chaser, keyframe.t), target = pose_at(scenario.truth_target, keyframe.t);
    if (!chaser || !target) continue;
    const Vector<3> seen = chaser->inverse().act(target->translation());
    const Vector<3> estimated = tracking.chaser_pose(k).inverse().act(tracking.target_state(k).position);
    Mean& mean = errors[keyframe.type];
    mean.sum += (estimated - seen).norm();
    ++mean.n;
  }
  for (const auto& [type, what] : {std::pair{KeyframeType::usbl, "a position"}, {KeyframeType::optical, "a pose"}})
    if (const Mean& mean = errors[type]; mean.n > 0)
      std::printf("%4d keyframes with %s measured: %.3f m off on average\n", mean.n, what, mean.sum / mean.n);
  const Mean& optical = errors[KeyframeType::optical];
  return summary.converged() && optical.n > 0 && optical.sum / optical.n < 0.2 ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
