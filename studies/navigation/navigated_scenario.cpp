#include <tandem/problem/tracking/ego_track.hpp>
#include <tandem/studies/navigation/navigated_scenario.hpp>
#include <tandem/studies/scenario/scenario_ego.hpp>

namespace tandem {
namespace {

/// Appends the state at the end of the data, predicted from the last state and the IMU samples after it.
void add_state_at_end(const NavigationData& data, std::vector<Stamped<EgoState>>& states) {
  const auto span = time_span(data);
  if (!span || !(span->second > states.back().t + kSameInstant)) return;
  Problem problem;
  EgoChain chain(problem, data);
  if (data.imu)
    for (const ImuSample& sample : data.imu->samples) chain.add(sample);
  chain.start(states.back().t, states.back().value, EgoStateSigmas());
  states.push_back({span->second, chain.predicted(span->second)});
}

}  // namespace

bool moves_by_odometry(const Scenario& settings) {
  return !settings.navigation || (settings.files.odometry && !settings.data.sensors.empty());
}

bool needs_navigation(const Scenario& scenario) {
  return scenario.navigation && scenario.data.odometry.empty() && !scenario.data.sensors.empty();
}

NavigatedScenario navigated(Scenario scenario, NavigationOptions options) {
  options.covariance = false;  // not needed for an initial guess
  Navigation navigation = navigate(scenario.navigation.value(), options);
  add_state_at_end(navigation.data, navigation.states);
  set_navigation(std::make_shared<const EgoTrack>(
                     EgoTrack{std::move(navigation.data), navigation.start, std::move(navigation.states), options.ego}),
                 scenario.data);
  return {std::move(scenario), std::move(navigation.findings)};
}

void set_navigation(std::shared_ptr<const EgoTrack> navigation, TrackingData& data) {
  data.odometry.clear();
  for (const auto& [t, state] : navigation->states) data.odometry.push_back({t, state.pose});
  data.ego = std::move(navigation);
}

}  // namespace tandem
