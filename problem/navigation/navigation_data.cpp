#include <array>

#include <tandem/problem/navigation/navigation_data.hpp>

namespace tandem {

std::string_view name(EgoSensorType type) {
  static constexpr std::array<std::string_view, 4> names{"dvl", "depth", "gps", "heading"};
  return names[static_cast<std::size_t>(type)];
}

int rows(EgoSensorType type) { return type == EgoSensorType::depth ? 1 : 3; }

}  // namespace tandem
