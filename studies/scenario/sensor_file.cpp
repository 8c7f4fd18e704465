#include <fmt/format.h>

#include <tandem/studies/scenario/sensor_file.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {

std::filesystem::path sensor_file(const YamlSection& sensor, const std::filesystem::path& folder) {
  const std::filesystem::path file = sensor.text("file");
  if (leads_outside(folder, file))
    sensor.fail("file", fmt::format("file {} is outside the scenario folder; use --allow-outside to read it",
                                    quote(file.string())));
  return folder / file;
}

}  // namespace tandem
