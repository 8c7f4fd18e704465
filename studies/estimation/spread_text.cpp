#include <fmt/format.h>

#include <tandem/studies/estimation/spread_text.hpp>

namespace tandem {

std::string spread_shown(const std::optional<MeanStd>& spread, int decimals) {
  if (!spread) return "–";
  constexpr double kWide = 1e6;  // does not fit into a column with fixed decimals
  if (!(spread->mean < kWide && spread->std < kWide)) return fmt::format("{:.3g} ± {:.3g}", spread->mean, spread->std);
  return fmt::format("{:.{}f} ± {:.{}f}", spread->mean, decimals, spread->std, decimals);
}

}  // namespace tandem
