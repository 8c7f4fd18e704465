#include <utility>
#include <vector>

#include <fmt/format.h>

#include <tandem/studies/fit/fit_text.hpp>
#include <tandem/studies/support/text.hpp>
#include <tandem/studies/support/text_table.hpp>

namespace tandem {
namespace {

/// Statistics of the residuals of a component.
struct ShownSeries {
  double mean, standard_deviation, correlation;
};
ShownSeries shown(const SensorFit& s, std::size_t component) {
  const auto of = [](const auto& x) { return ShownSeries{x.mean(), x.standard_deviation(), x.correlation()}; };
  return s.series.empty() ? of(s.moments[component]) : of(s.series[component]);
}

struct NamedWorst {
  std::string component;
  WorstMeasurement worst;
};

}  // namespace

std::string fit_text(const FitReport& fit) {
  constexpr auto kLeft = TextTable::Align::left;
  TextTable table({{"fit", kLeft},
                   {"used"},
                   {"rejected"},
                   {"down-weighted"},
                   {"worst component"},
                   {"mean"},
                   {"σ"},
                   {"lag-1 correlation"},
                   {"largest residual"}});
  for (const SensorFit& s : fit.sensors) {
    if (s.used + s.rejected == 0) continue;
    if (s.components.empty()) {
      table.row({printable(s.name), std::to_string(s.used), std::to_string(s.rejected), std::to_string(s.down_weighted),
                 "–", "–", "–", "–", "–"});
      continue;
    }
    const std::size_t c = s.worst_component();
    const ShownSeries series = shown(s, c);
    table.row({printable(s.name), std::to_string(s.used), std::to_string(s.rejected), std::to_string(s.down_weighted),
               s.components[c], fmt::format("{:+.2f}", series.mean), fmt::format("{:.2f}", series.standard_deviation),
               fmt::format("{:.2f}", series.correlation),
               s.worst.empty() ? "–"
                               : fmt::format("{:+.1f} ({} at {:.3f} s)", s.worst[0].residual,
                                             s.components[s.worst[0].component], s.worst[0].t)});
  }
  return table.str() +
         "Residuals are in expected standard deviations: mean 0, σ 1 and correlation 0 if the noise is as stated.\n" +
         fit.verdict() + "\n";
}

JsonFields<FitReport> fit_fields() {
  const auto series = JsonFields<ShownSeries>()
                          .add("mean", "mean of the standardised residuals; 0 if consistent",
                               [](const ShownSeries& s) { return s.mean; })
                          .add("sigma", "their standard deviation; 1 if consistent",
                               [](const ShownSeries& s) { return s.standard_deviation; })
                          .add("correlation", "their autocorrelation at lag 1; 0 if consistent",
                               [](const ShownSeries& s) { return s.correlation; });
  const auto worst = JsonFields<NamedWorst>()
                         .add("t", "stamp of the measurement; of tandem track, the time at which it was valid [s]",
                              [](const NamedWorst& w) { return w.worst.t; })
                         .add("component", "component of the sensor", [](const NamedWorst& w) { return w.component; })
                         .add("residual", "residual in expected standard deviations",
                              [](const NamedWorst& w) { return w.worst.residual; });
  const auto sensor =
      JsonFields<SensorFit>()
          .add("used", "number of measurements used", [](const SensorFit& s) { return s.used; })
          .add("rejected", "number rejected since they contradict the others",
               [](const SensorFit& s) { return s.rejected; })
          .add("down_weighted", "number that the robust loss gives a weight below 0.5",
               [](const SensorFit& s) { return s.down_weighted; })
          .add("expected_down_weighted", "expected number of down-weighted measurements if the noise is as stated",
               [](const SensorFit& s) { return s.expected_down_weighted; })
          .add_map("components", "COMPONENT", "standardised residuals of the measurements that are not down-weighted",
                   series,
                   [](const SensorFit& s) {
                     std::vector<std::pair<std::string, ShownSeries>> all;
                     for (std::size_t c = 0; c < s.components.size(); ++c)
                       all.emplace_back(s.components[c], shown(s, c));
                     return all;
                   })
          .add_list("worst", "the five measurements with the largest residuals", worst,
                    [](const SensorFit& s) {
                      std::vector<NamedWorst> all;
                      for (const WorstMeasurement& w : s.worst) all.push_back({s.components[w.component], w});
                      return all;
                    })
          .add("misfit", "how the residuals contradict the stated noise; empty if they do not",
               [](const SensorFit& s) { return s.misfit(); });
  return JsonFields<FitReport>()
      .add("consistent", "whether no residual and no cost exceeds what the stated noise explains",
           [](const FitReport& f) { return f.consistent(); })
      .add("verdict", "the verdict in words", [](const FitReport& f) { return f.verdict(); })
      .add("noise_far_too_large", "whether the cost is below a quarter of its expectation, so that the fit says little",
           [](const FitReport& f) { return f.noise_is_far_too_large(); })
      .add("oversized", "noise entries that are too large for the residuals, with the factors; empty if there are none",
           [](const FitReport& f) { return f.oversized_noises(); })
      .add("cost", "cost of the problem", [](const FitReport& f) { return f.cost; })
      .add("expected_cost", "expected cost if the noise is as stated",
           [](const FitReport& f) { return f.expected_cost; })
      .add("cost_sigma", "standard deviation of the cost in that case", [](const FitReport& f) { return f.cost_sigma; })
      .add_map("sensors", "SENSOR", "fit of each sensor", sensor, [](const FitReport& f) {
        std::vector<std::pair<std::string, SensorFit>> all;
        for (const SensorFit& s : f.sensors) all.emplace_back(s.name, s);
        return all;
      });
}

}  // namespace tandem
