#include <algorithm>
#include <cmath>

#include <tandem/lie/error.hpp>
#include <tandem/problem/navigation/navigation_problem.hpp>

namespace tandem {

std::vector<EgoEvent> in_time_order(const std::vector<EgoSensor>& sensors) {
  std::vector<EgoEvent> events;
  for (std::size_t s = 0; s < sensors.size(); ++s)
    for (std::size_t i = 0; i < sensors[s].measurements.size(); ++i)
      events.push_back({sensors[s].valid_at(sensors[s].measurements[i]), s, i});
  std::stable_sort(events.begin(), events.end(), [](const EgoEvent& a, const EgoEvent& b) { return a.t < b.t; });
  return events;
}

NavigationProblem make_navigation_problem(const NavigationData& data, const std::vector<Stamped<EgoState>>& guess,
                                          const Alignment& start, const EgoOptions& options, const Stop& stop) {
  if (guess.size() < 2) throw BadInputError("a navigation problem needs at least two keyframes");
  NavigationProblem out;
  EgoChain chain(out.problem, data, options);
  if (data.imu)
    for (const ImuSample& sample : data.imu->samples) chain.add(sample);
  out.num_discarded.assign(data.sensors.size(), 0);

  const std::vector<EgoEvent> events = in_time_order(data.sensors);
  auto event = events.begin();
  for (std::size_t k = 0; k < guess.size(); ++k) {
    stop.check("building the problem");
    k == 0 ? chain.start(guess[0].t, start.state, start.sigmas, guess[0].value)
           : chain.extend(guess[k].t, guess[k].value);
    const double until = k + 1 < guess.size() ? guess[k + 1].t - kSameInstant : HUGE_VAL;
    for (; event != events.end() && event->t <= until; ++event) {
      if (chain.can_attach(event->t)) {
        const EgoMeasurement& m = data.sensors[event->sensor].measurements[event->index];
        out.measurements.push_back(chain.attach(event->sensor, m, event->t));
        out.measurements.back().index = event->index;
      } else {
        ++out.num_discarded[event->sensor];
      }
    }
  }
  out.keyframes.assign(chain.keyframes().begin(), chain.keyframes().end());
  out.dvl_scale = chain.dvl_scale();
  out.constants = chain.constants();
  out.splits = chain.splits();
  return out;
}

EgoState NavigationProblem::state(std::size_t k) const { return state_at(problem, keyframes[k]); }

}  // namespace tandem
