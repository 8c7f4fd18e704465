// Reads a scenario folder and estimates both trajectories, like `tandem estimate FOLDER`.
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
  const Scenario scenario = read_scenario(argv[1]);  // throws an Error with file and line
  TrackingOptions options;
  options.non_holonomic = Role::soft;  // small sway and heave of the target
  TrackingProblem tracking = make_tracking_problem(scenario.data, options);
  const Summary summary = solve(tracking.problem, GaussNewtonOptions{});
  std::printf("%s: %zu keyframes, cost %.1f, %.3f s, %s\n", scenario.name.c_str(), tracking.keyframes.size(),
              summary.cost, summary.seconds, summary.message.c_str());

  // Compares the target position in the chaser's frame with the truth, by the type of the keyframe.
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
  for (const auto& [type, what] : {std::pair{KeyframeType::position, "a position"}, {KeyframeType::pose, "a pose"}})
    if (const Mean& mean = errors[type]; mean.n > 0)
      std::printf("%4d keyframes with %s measurement: mean error %.3f m\n", mean.n, what, mean.sum / mean.n);
  const Mean& pose = errors[KeyframeType::pose];
  return summary.converged() && pose.n > 0 && pose.sum / pose.n < 0.2 ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
