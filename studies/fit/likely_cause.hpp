#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <tandem/lie/so3.hpp>
#include <tandem/problem/parallel_tasks.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/studies/support/json_fields.hpp>

namespace tandem {

/// A change of a sensor's data or settings that explains its misfit.
struct LikelyCause {
  std::string sensor;
  std::string text;              ///< "quaternions are ordered w x y z"
  double before = 0, after = 0;  ///< cost of a part of the recording without and with the change
};

/// A mistake that users make with a sensor, and the change of the data that corrects it.
template <class Data>
struct Mistake {
  std::string sensor, text;
  std::function<void(Data&)> mend;
  double expected = 0;  ///< expected cost of the measurements that the change leaves out
};

/// Axes that vectors in files may have instead of those of the frame, and the matrices that convert the vectors in
/// Tandem's axes. `frame` is Frame::body_axes() or Frame::world_axes().
std::vector<std::pair<std::string, Matrix<3, 3>>> mistaken_axes(const Matrix<3, 3>& frame);
/// Delays to try [s], in addition to the given one, and their text.
inline constexpr std::array kMistakenDelays = {0.2, -0.2, 0.5, -0.5, 1.0, -1.0, 2.0, -2.0, 4.0};
std::string mistaken_delay_text(double delay);
/// Returns the rotation of a file's quaternion w x y z. `read` is the rotation by the order x y z w.
SO3 ordered_w_first(const SO3& read);
inline constexpr const char* kQuaternionOrder = "quaternions are ordered w x y z";
inline constexpr const char* kMistakenLeverArm = "it has a constant bias, or a wrong lever arm";
inline constexpr const char* kMisaligned = "it is misaligned";
inline constexpr const char* kContradicts = "it contradicts the other sensors, which agree without it";
inline constexpr double kWideBias = 30;           ///< prior of a bias, relative to the sensor's noise
inline constexpr double kWideMisalignment = 0.5;  ///< prior of a misalignment [rad]

/// Leaves the causes with the lowest costs, at most three. If costs hardly differ, the first mistake comes first.
void keep_best(std::vector<LikelyCause>& causes);

/// Decrease of the cost of a part by which the correction of a mistake explains a misfit.
struct RequiredGain {
  double share = 1.0 / 3;  ///< of the cost
  double absolute = 0;
};

/// Corrects one mistake at a time in a part of a recording. Returns those whose correction has the required gain, the
/// best first, at most three. `cost(data)` returns the cost at the solution, or nothing if there is none; calls are
/// concurrent. If it throws Stopped, that mistake is left out.
template <class Data, class Cost>
std::vector<LikelyCause> explaining(const std::vector<Mistake<Data>>& mistakes, const Data& part, Cost cost,
                                    RequiredGain gain = {}) {
  const auto cost_with = [&](const std::function<void(Data&)>& mend) -> std::optional<double> {
    try {
      Data changed = part;
      mend(changed);
      return cost(changed);
    } catch (const Stopped&) {  // a time limit or an interrupt
      return {};
    }
  };
  const std::optional<double> before = cost_with([](Data&) {});
  if (!before) return {};
  std::vector<std::optional<double>> after(mistakes.size());
  detail::TaskRunner().run(int(mistakes.size()),
                           [&](int i) { after[std::size_t(i)] = cost_with(mistakes[std::size_t(i)].mend); });
  std::vector<LikelyCause> causes;
  for (std::size_t i = 0; i < mistakes.size(); ++i) {
    if (!after[i]) continue;
    const double gained = *before - *after[i] - mistakes[i].expected;
    if (gained > gain.share * *before && gained > gain.absolute)
      causes.push_back({mistakes[i].sensor, mistakes[i].text, *before, *after[i] + mistakes[i].expected});
  }
  keep_best(causes);
  return causes;
}

/// Returns a sentence on each cause, for the results of a command.
std::string likely_causes_text(const std::vector<LikelyCause>& causes);
/// Returns the fields of the JSON objects in `likely_causes`.
JsonFields<LikelyCause> likely_cause_fields();

}  // namespace tandem
