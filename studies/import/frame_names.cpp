#include <algorithm>
#include <array>
#include <cctype>
#include <string>

#include <tandem/studies/import/frame_names.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr std::array<std::string_view, 12> kWorldFrames = {
    "map", "odom", "odometry", "world", "earth", "utm", "local_origin", "enu", "ned", "global", "ecef", "wgs84"};

}  // namespace

bool is_world_frame(std::string_view name) {
  while (name.ends_with('/')) name.remove_suffix(1);
  const std::string last = lower_case(name.substr(name.rfind('/') + 1));  // without the prefix of a robot
  return std::any_of(kWorldFrames.begin(), kWorldFrames.end(), [&](std::string_view frame) {
    return last.starts_with(frame) &&
           (last.size() == frame.size() || !std::isalpha(static_cast<unsigned char>(last[frame.size()])));
  });
}

}  // namespace tandem
