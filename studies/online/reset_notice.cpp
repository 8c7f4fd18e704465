#include <vector>

#include <fmt/format.h>

#include <tandem/studies/online/reset_notice.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {

std::string hard_options(const TrackingOptions& target) {
  std::vector<std::string> names;
  if (target.non_holonomic == Role::hard) names.push_back("--non-holonomic hard");
  if (target.roll_pitch == Role::hard) names.push_back("--roll-pitch hard");
  if (target.limits == Role::hard && target.surge) names.push_back("--surge");
  if (target.limits == Role::hard && target.max_yaw_rate) names.push_back("--yaw-rate");
  return listed(names);
}

std::string reset_notice(const TrackReset& reset, const TrackingOptions& target) {
  using Kind = TrackReset::Kind;
  if (reset.kind == Kind::suspended) return reset.why + "; the track is suspended until the next usable measurement";
  const std::string hard = reset.kind == Kind::time_reset ? "" : hard_options(target);
  return reset.why + "; the track is reset" +
         (hard.empty() ? "" : "; if the target does not satisfy " + hard + ", use soft constraints");
}

std::string shift_notice(const std::string& sensor, const std::vector<std::string>& components,
                         const InnovationShift& shift, const std::string& others) {
  const std::string component = shift.component < components.size() ? components[shift.component] + " of " : "";
  return fmt::format("{}{} has shifted by {:+.1f} standard deviations since {:.1f} s: ", component, sensor, shift.mean,
                     shift.since) +
         (others.empty() ? "no other sensor measures the same"
                         : fmt::format("it or a sensor that contradicts it ({}) is wrong", others));
}

}  // namespace tandem
