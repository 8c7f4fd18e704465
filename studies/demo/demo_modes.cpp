#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/demo/demo_modes.hpp>
#include <tandem/studies/estimation/spread_text.hpp>
#include <tandem/studies/study/trial_online.hpp>
#include <tandem/studies/support/output_file.hpp>
#include <tandem/studies/support/text_table.hpp>

namespace tandem::modes {
namespace {

constexpr double kWindow = 60.0, kAround = 60.0;  // s

TrackingOptions options_of(Mode mode) {
  TrackingOptions options;
  options.mode = mode;
  return options;
}

std::vector<Instant> instants_of(const Scenario& scenario, const std::vector<KeyframeError>& errors) {
  std::vector<Instant> instants;
  for (const KeyframeError& error : errors) {
    Instant& instant =
        instants.emplace_back(Instant{error.t, error.type, {}, error.raw_position, error.raw_orientation});
    if (const auto truth = pose_at(scenario.truth_target, error.t)) instant.truth = truth->translation();
  }
  return instants;
}

/// Each state beside the keyframe of its time.
void add_states(const std::vector<KeyframeError>& errors, const std::vector<TargetState>& target,
                const std::vector<KeyframeUncertainty>& uncertainty, std::optional<ModeState> Instant::*mode,
                std::vector<Instant>& instants) {
  std::size_t i = 0;
  for (std::size_t k = 0; k < errors.size(); ++k) {
    while (i < instants.size() && instants[i].t < errors[k].t - kSameInstant) ++i;
    if (i == instants.size() || instants[i].t > errors[k].t + kSameInstant) continue;
    ModeState state{target[k].position, errors[k].position, errors[k].orientation};
    if (!uncertainty.empty()) state.three_sigma = 3 * uncertainty[k].position_sigma().norm();
    instants[i].*mode = state;
  }
}

Moments moments_of(const std::vector<Instant>& instants, std::optional<KeyframeType> type,
                   const std::function<std::optional<double>(const Instant&)>& value) {
  Moments moments;
  for (const Instant& instant : instants)
    if (!type || instant.type == *type) moments.add(value(instant));
  return moments;
}

using Value = std::function<std::optional<double>(const Instant&)>;

Value error_of_mode(std::optional<ModeState> Instant::*mode, std::optional<double> ModeState::*what) {
  return [=](const Instant& i) -> std::optional<double> { return i.*mode ? (*(i.*mode)).*what : std::nullopt; };
}

}  // namespace

std::vector<Instant> by_all_data(const Scenario& scenario, const Solver& solver) {
  std::vector<Instant> instants;
  for (const Mode mode : {Mode::A, Mode::B}) {
    const Estimate estimated = estimate(scenario, options_of(mode), solver);
    if (!estimated.summary.converged())
      throw Error(fmt::format("mode {} did not converge: {}", name(mode), estimated.summary.message));
    if (instants.empty()) instants = instants_of(scenario, estimated.errors);
    add_states(estimated.errors, estimated.target, estimated.uncertainty, mode == Mode::A ? &Instant::a : &Instant::b,
               instants);
  }
  return instants;
}

std::vector<Instant> as_data_come(const Scenario& scenario) {
  std::vector<Instant> instants;
  for (const Mode mode : {Mode::A, Mode::B}) {
    const NewestStates newest = newest_states(scenario, options_of(mode), kWindow);
    const std::vector<KeyframeError> errors = keyframe_errors(scenario, newest.keyframes, newest.chaser, newest.target);
    if (instants.empty()) instants = instants_of(scenario, errors);
    add_states(errors, newest.target, {}, mode == Mode::A ? &Instant::a : &Instant::b, instants);
  }
  return instants;
}

std::vector<Instant> about_the_longest_gap(const std::vector<Instant>& instants) {
  double begin = 0, end = 0;
  std::optional<double> last;
  for (const Instant& instant : instants) {
    if (instant.type == KeyframeType::gated) continue;
    if (last && instant.t - *last > end - begin) begin = *last, end = instant.t;
    last = instant.t;
  }
  std::vector<Instant> about;
  std::copy_if(instants.begin(), instants.end(), std::back_inserter(about),
               [&](const Instant& i) { return i.t >= begin - kAround && i.t <= end + kAround; });
  return about;
}

std::string table1(const std::vector<Instant>& instants) {
  using Row = std::pair<const char*, std::optional<KeyframeType>>;
  const Value raw = [](const Instant&i) { return i.raw_error; },
              raw_angle = [](const Instant&i) { return i.raw_angle; };
  const Value a = error_of_mode(&Instant::a, &ModeState::error), b = error_of_mode(&Instant::b, &ModeState::error);
  const Value a_angle = error_of_mode(&Instant::a, &ModeState::angle);
  const Value b_angle = error_of_mode(&Instant::b, &ModeState::angle);
  TextTable table(
      {{"keyframes", TextTable::Align::left}, {"n"}, {"raw"}, {"Mode A"}, {"Mode B"}, {"raw"}, {"Mode A"}, {"Mode B"}});
  table.group(2, 4, "position [m]");
  table.group(5, 7, "orientation [°]");
  const auto spread = [&](const Row& row, const Value& value, int decimals) {
    return spread_shown(moments_of(instants, row.second, value).spread(), decimals);
  };
  for (const Row& row : {Row{"usbl", KeyframeType::usbl},
                         {"optical", KeyframeType::optical},
                         {"gated", KeyframeType::gated},
                         {"all", {}}}) {
    const auto n = std::count_if(instants.begin(), instants.end(),
                                 [&](const Instant& i) { return !row.second || i.type == *row.second; });
    table.row({row.first, fmt::format("{}", n), row.second ? spread(row, raw, 3) : "–", spread(row, a, 3),
               spread(row, b, 3), row.second ? spread(row, raw_angle, 2) : "–", spread(row, a_angle, 2),
               spread(row, b_angle, 2)});
  }
  const auto mean = [&](const Value& value) {
    const auto of = moments_of(instants, KeyframeType::usbl, value).spread();
    return of ? of->mean : std::nan("");
  };
  return fmt::format(
      "{}\nAt USBL keyframes: Mode A {:.2f} of raw, Mode B {:.2f} of raw, Mode B / Mode A {:.2f} "
      "(the paper's Table I: 0.55, 0.89, 1.61).\n",
      table.str(), mean(a) / mean(raw), mean(b) / mean(raw), mean(b) / mean(a));
}

namespace {

CsvTable<Instant> instant_columns() {
  CsvTable<Instant> table;
  table.add("t", "time of the keyframe [s]", [](const Instant& i) { return i.t; })
      .add("type", "of the keyframe: optical, usbl or gated", [](const Instant& i) { return name(i.type); })
      .add_xyz("truth_{}_m", "true position of the target [m]", [](const Instant& i) { return i.truth; })
      .add("raw_error_m", "of the measurement itself [m]", [](const Instant& i) { return i.raw_error; });
  for (const auto& [letter, mode] : {std::pair{"a", &Instant::a}, {"b", &Instant::b}}) {
    const auto m = mode;
    const std::string of = fmt::format("{}_", letter);
    table
        .add_xyz(of + "{}_m", "the mode's position of the target [m]",
                 [m](const Instant& i) { return i.*m ? std::optional((i.*m)->target) : std::nullopt; })
        .add(of + "error_m", "of the mode's relative position [m]", error_of_mode(m, &ModeState::error))
        .add(of + "three_sigma_m", "3 √trace of its covariance [m]", error_of_mode(m, &ModeState::three_sigma))
        .add(of + "orientation_error_deg", "error of the mode's relative orientation [deg]",
             error_of_mode(m, &ModeState::angle));
  }
  return table;
}

}  // namespace

void write_instants(const std::vector<Instant>& instants, const std::filesystem::path& file) {
  write_file(file, instant_columns().text(instants));
}

CsvDescription file_columns(std::string file) { return instant_columns().describe(std::move(file)); }

}  // namespace tandem::modes
