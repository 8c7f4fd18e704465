#include <atomic>

#include <fmt/format.h>

#include <tandem/studies/scenario/sensor_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

std::atomic<bool> outside_allowed{false};

}  // namespace

void allow_outside_files(bool allowed) { outside_allowed = allowed; }

std::filesystem::path sensor_file(const YamlSection& sensor, const std::filesystem::path& folder) {
  const std::filesystem::path file = sensor.text("file");
  const std::filesystem::path normal = file.lexically_normal();
  if (!outside_allowed && (file.is_absolute() || (!normal.empty() && *normal.begin() == "..")))
    sensor.fail("file", fmt::format("file {} is outside the scenario folder; use --allow-outside to read it",
                                    quote(file.string())));
  return folder / file;
}

}  // namespace tandem
