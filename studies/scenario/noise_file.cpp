#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/studies/scenario/named_noise.hpp>
#include <tandem/studies/scenario/noise_file.hpp>
#include <tandem/studies/scenario/yaml_section.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {

std::vector<NoiseEntry> read_noise_file(const std::filesystem::path& file) {
  const YamlSection root = YamlSection::load(file);
  root.allow_only({"noise"});
  const YamlSection noise = root.section("noise");
  std::vector<NoiseEntry> entries;
  for (const std::string& name : noise.keys()) {
    entries.push_back({name, noise.numbers(name)});
    const std::vector<double>& sigmas = entries.back().sigmas;
    if (const std::string reason = why_invalid_sigmas(sigmas, sigmas.size()); !reason.empty())
      noise.fail(name, fmt::format("{} {}", name, reason));
  }
  if (entries.empty()) root.fail("noise", "noise is empty; give at least one standard deviation");
  return entries;
}

std::string noise_file_text(const std::vector<NoiseEntry>& entries, const std::string& comment) {
  std::string text;
  for (const std::string_view line : split(comment, '\n'))
    if (!line.empty()) text += fmt::format("# {}\n", line);
  text += "noise:\n";
  for (const NoiseEntry& entry : entries)
    text += fmt::format("  {}: [{:.6g}]\n", yaml_text(entry.name), fmt::join(entry.sigmas, ", "));
  return text;
}

}  // namespace tandem
