#include <fmt/format.h>

#include <tandem/studies/estimation/spread_text.hpp>

namespace tandem {

std::string spread_shown(const std::optional<MeanStd>& spread, int decimals) {
  if (!spread) return "–";
  constexpr double kWide = 1e6;  // wider than a column in digits
  if (!(spread->mean < kWide && spread->std < kWide)) return fmt::format("{:.3g} ± {:.3g}", spread->mean, spread->std);
  return fmt::format("{:.{}f} ± {:.{}f}", spread->mean, decimals, spread->std, decimals);
}

void add_spread(nlohmann::ordered_json& json, const std::string& key, const std::string& unit,
                const std::optional<MeanStd>& spread) {
  if (!spread) return;
  json[key + "_mean_" + unit] = spread->mean;
  json[key + "_std_" + unit] = spread->std;
}

nlohmann::ordered_json errors_json(const ErrorSummary& errors) {
  nlohmann::ordered_json json = {{"n", errors.n}};
  if (errors.compared > 0 && errors.compared < errors.n) json["n_with_truth"] = errors.compared;
  add_spread(json, "position", "m", errors.position);
  add_spread(json, "orientation", "deg", errors.orientation);
  add_spread(json, "raw_position", "m", errors.raw_position);
  add_spread(json, "raw_orientation", "deg", errors.raw_orientation);
  return json;
}

}  // namespace tandem
