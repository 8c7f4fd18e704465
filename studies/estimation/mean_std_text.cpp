#include <fmt/format.h>

#include <tandem/studies/estimation/mean_std_text.hpp>

namespace tandem {

std::string mean_std_text(const std::optional<MeanStd>& errors, int decimals) {
  if (!errors) return "–";
  constexpr double kWide = 1e6;  // does not fit into a column with fixed decimals
  if (!(errors->mean < kWide && errors->std < kWide)) return fmt::format("{:.3g} ± {:.3g}", errors->mean, errors->std);
  return fmt::format("{:.{}f} ± {:.{}f}", errors->mean, decimals, errors->std, decimals);
}

std::string mean_text(const std::optional<MeanStd>& errors, int decimals) {
  return errors ? fmt::format("{:.{}f}", errors->mean, decimals) : "–";
}

}  // namespace tandem
