#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/calibration/noise_parameters.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

bool is_among(const std::string& name, const std::vector<std::string>& names) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Throws Error if `free` has an unknown name. Model parameters and constants must have been removed from it.
void check_names(const std::vector<CalibratedEntry>& entries, const std::vector<std::string>& free,
                 const std::vector<ModelParameterEntry>& model_parameters) {
  std::vector<std::string> known, near, shown;
  const auto show = [&](const std::string& name, const std::vector<std::string>& components) {
    shown.push_back(components.empty() ? name : fmt::format("{} ({})", name, fmt::join(components, ", ")));
  };
  for (const CalibratedEntry& e : entries) {
    known.push_back(e.name);
    std::vector<std::string> components;
    for (std::size_t c = 0; c < e.components.size(); ++c)
      if (!e.components[c].empty()) known.push_back(e.parameter(c)), components.push_back(e.components[c]);
    show(e.name, components);
  }
  near = known;
  for (const CalibratedEntry& e : entries)
    if (e.sensor)
      for (const char* constant : {".scale", ".misalignment", ".delay"}) near.push_back(e.name + constant);
  for (const ModelParameterEntry& p : model_parameters) {
    near.push_back(p.name);
    for (const std::string& component : p.components) near.push_back(p.name + "." + component);
    if (p.available && !p.components.empty()) show(p.name, p.components);
  }
  for (const std::string& name : free) {
    for (const CalibratedEntry& e : entries)
      if (e.sensor && name == e.name + ".bias")
        throw Error(
            fmt::format("--free {}: to estimate a constant bias, give its standard deviation with --error {}=SIGMA,...",
                        name, e.name));
    if (!is_among(name, known))
      throw Error(
          fmt::format("--free: unknown name {}{} (available, with components: {}; for sensors also scale, "
                      "misalignment, delay, time and dof)",
                      quote(name), did_you_mean(name, near), listed(shown)));
  }
}

void add_rows(const CalibrationProblems& problems, std::size_t e, std::size_t c, NoiseGroup& group) {
  for (std::size_t p = 0; p < problems.size(); ++p) {
    CalibrationProblem& built = *problems[p];
    const auto& entries = built.entries;
    const CalibratedEntry& wanted = problems.front()->entries[e];
    for (const EntryBlock& b : built.blocks) {
      const CalibratedEntry& entry = entries[b.entry];
      if (entry.name != wanted.name) continue;
      const int rows = static_cast<int>(built.problem().noise(b.block).dim());
      const int n = static_cast<int>(entry.components.size());
      for (int i = entry.row[c] - b.first; i < rows; i += n)
        if (i >= 0)
          group.rows.push_back({b.block, i, 1, static_cast<int>(p), b.shared < 0 || i < b.shared ? b.share : 1.0});
    }
  }
}

}  // namespace

NoiseParameters::NoiseParameters(const CalibrationProblems& problems, const ScenarioCalibrationOptions& options,
                                 const std::vector<ModelParameterEntry>& model_parameters) {
  const std::vector<CalibratedEntry>& entries = problems.front()->entries;
  check_names(entries, options.free, model_parameters);
  for (std::size_t e = 0; e < entries.size(); ++e)
    for (std::size_t c = 0; c < entries[e].components.size(); ++c) {
      const std::string name = entries[e].parameter(c);
      const bool named = is_among(name, options.free) || is_among(entries[e].name, options.free);
      if (!options.noise || (!named && !options.free.empty())) continue;
      NoiseGroup group{name, {}, options.prior};
      add_rows(problems, e, c, group);
      if (group.rows.empty()) {
        if (named)
          throw Error(fmt::format("--free {}: {} has no residual with this noise", name, problems.front()->scenario));
        continue;
      }
      groups.push_back(std::move(group));
      entry.push_back(e);
      component.push_back(c);
    }
  if (groups.empty() && options.noise)
    throw Error("calibrate: the problem has no residuals whose noise can be calibrated");
}

void NoiseParameters::keep_given(std::size_t g) {
  const auto at = std::ptrdiff_t(g);
  groups.erase(groups.begin() + at);
  entry.erase(entry.begin() + at);
  component.erase(component.begin() + at);
}

bool NoiseParameters::has(const std::string& name) const {
  return std::any_of(groups.begin(), groups.end(), [&](const NoiseGroup& group) { return group.name == name; });
}

}  // namespace tandem
