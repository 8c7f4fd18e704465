#pragma once

#include <string_view>

namespace tandem {

/// Returns whether a frame of ROS is one of the world by its name: "map", "/odom", "world_enu", "robot1/map", "utm", ….
bool is_world_frame(std::string_view name);

}  // namespace tandem
