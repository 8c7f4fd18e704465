#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/estimation/error_fields.hpp>
#include <tandem/studies/estimation/mean_std_text.hpp>
#include <tandem/studies/paper/paper_modes.hpp>
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

/// Copies the states of a mode to the instants with the same times.
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

std::vector<Instant> batch_estimates(const Scenario& scenario, const AnySolver& solver) {
  std::vector<Instant> instants;
  for (const Mode mode : {Mode::A, Mode::B}) {
    const Estimate estimated = estimate(scenario, options_of(mode), solver);
    if (!estimated.summary.converged())
      throw NotConverged(
          fmt::format("the solve in mode {} did not converge: {}", name(mode), estimated.summary.message));
    if (instants.empty()) instants = instants_of(scenario, estimated.errors);
    add_states(estimated.errors, estimated.target, estimated.uncertainty, mode == Mode::A ? &Instant::a : &Instant::b,
               instants);
  }
  return instants;
}

std::vector<Instant> online_estimates(const Scenario& scenario) {
  std::vector<Instant> instants;
  for (const Mode mode : {Mode::A, Mode::B}) {
    const NewestStates newest = newest_states(scenario, options_of(mode), kWindow);
    const std::vector<KeyframeError> errors = keyframe_errors(scenario, newest.keyframes, newest.chaser, newest.target);
    if (instants.empty()) instants = instants_of(scenario, errors);
    add_states(errors, newest.target, {}, mode == Mode::A ? &Instant::a : &Instant::b, instants);
  }
  return instants;
}

std::vector<Instant> around_longest_gap(const std::vector<Instant>& instants) {
  double begin = 0, end = 0;
  std::optional<double> last;
  for (const Instant& instant : instants) {
    if (instant.type == KeyframeType::none) continue;
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
  TextTable table({{"measurement", TextTable::Align::left},
                   {"n"},
                   {"raw"},
                   {"Mode A"},
                   {"Mode B"},
                   {"raw"},
                   {"Mode A"},
                   {"Mode B"}});
  table.group(2, 4, "position [m]");
  table.group(5, 7, "orientation [°]");
  const auto errors = [&](const Row& row, const Value& value, int decimals) {
    return mean_std_text(moments_of(instants, row.second, value).mean_std(), decimals);
  };
  for (const Row& row : {Row{"position", KeyframeType::position},
                         {"pose", KeyframeType::pose},
                         {"none", KeyframeType::none},
                         {"all", {}}}) {
    const auto n = std::count_if(instants.begin(), instants.end(),
                                 [&](const Instant& i) { return !row.second || i.type == *row.second; });
    table.row({row.first, fmt::format("{}", n), row.second ? errors(row, raw, 3) : "–", errors(row, a, 3),
               errors(row, b, 3), row.second ? errors(row, raw_angle, 2) : "–", errors(row, a_angle, 2),
               errors(row, b_angle, 2)});
  }
  const auto mean = [&](const Value& value) {
    const auto of = moments_of(instants, KeyframeType::position, value).mean_std();
    return of ? of->mean : std::nan("");
  };
  return fmt::format(
      "{}\nRatios of the mean position errors at keyframes with a position: Mode A / raw {:.2f}, Mode B / raw {:.2f}, "
      "Mode B / Mode A {:.2f}\n(Table I of the paper: 0.55, 0.89, 1.61).\n",
      table.str(), mean(a) / mean(raw), mean(b) / mean(raw), mean(b) / mean(a));
}

namespace {

/// The instants of a figure, and the type of the keyframes to summarise; empty: all types.
struct Selection {
  const std::vector<Instant>& instants;
  std::optional<KeyframeType> type;
};

JsonFields<Selection> error_fields() {
  using S = Selection;
  JsonFields<S> fields;
  fields.add("n", "number of keyframes", [](const S& s) {
    return std::count_if(s.instants.begin(), s.instants.end(),
                         [&](const Instant& i) { return !s.type || i.type == *s.type; });
  });
  const auto add = [&](const std::string& key, const std::string& unit, const std::string& what, Value value) {
    add_mean_std(fields, key, unit, what,
                 [value = std::move(value)](const S& s) { return moments_of(s.instants, s.type, value).mean_std(); });
  };
  add("raw_position", "m", "position error of the measurements [m]", [](const Instant& i) { return i.raw_error; });
  add("a_position", "m", "position error in Mode A [m]", error_of_mode(&Instant::a, &ModeState::error));
  add("b_position", "m", "position error in Mode B [m]", error_of_mode(&Instant::b, &ModeState::error));
  add("raw_orientation", "deg", "orientation error of the measurements [deg]",
      [](const Instant& i) { return i.raw_angle; });
  add("a_orientation", "deg", "orientation error in Mode A [deg]", error_of_mode(&Instant::a, &ModeState::angle));
  add("b_orientation", "deg", "orientation error in Mode B [deg]", error_of_mode(&Instant::b, &ModeState::angle));
  return fields;
}

struct Document {
  const std::string& figure;
  const std::vector<Instant>& instants;
};

JsonFields<Document> document_fields() {
  return JsonFields<Document>()
      .add("figure", "table1, fig1, fig6 or fig7", [](const Document& d) { return d.figure; })
      .add_map("errors", "TYPE",
               "errors of the relative pose by the measurement at the keyframe: position, pose, none; and at all "
               "keyframes",
               error_fields(), [](const Document& d) {
                 return std::vector<std::pair<std::string, Selection>>{
                     {"position", {d.instants, KeyframeType::position}},
                     {"pose", {d.instants, KeyframeType::pose}},
                     {"none", {d.instants, KeyframeType::none}},
                     {"all", {d.instants, {}}}};
               });
}

CsvTable<Instant> instant_columns() {
  CsvTable<Instant> table;
  table.add("t", "time of the keyframe [s]", [](const Instant& i) { return i.t; })
      .add("type", kKeyframeTypeColumn, [](const Instant& i) { return name(i.type); })
      .add_xyz("truth_{}_m", "true position of the target in the world [m]", [](const Instant& i) { return i.truth; })
      .add("raw_error_m", "position error of the measurement itself [m]", [](const Instant& i) { return i.raw_error; });
  for (const auto& [letter, mode] : {std::pair{"a", &Instant::a}, {"b", &Instant::b}}) {
    const auto m = mode;
    const std::string of = fmt::format("{}_", letter);
    table
        .add_xyz(of + "{}_m", "position of the target in the world by the mode [m]",
                 [m](const Instant& i) { return i.*m ? std::optional((i.*m)->target) : std::nullopt; })
        .add(of + "error_m", "error of the relative position by the mode [m]", error_of_mode(m, &ModeState::error))
        .add(of + "three_sigma_m", "3 √trace of the covariance of that position [m]",
             error_of_mode(m, &ModeState::three_sigma))
        .add(of + "orientation_error_deg", "error of the relative orientation by the mode [deg]",
             error_of_mode(m, &ModeState::angle));
  }
  return table;
}

}  // namespace

std::string json(const std::string& figure, const std::vector<Instant>& instants) {
  return json_text(json_document("paper", document_fields(), Document{figure, instants}));
}

FileDescription json_keys() { return describe_json("--json table1", "paper", document_fields()); }

void write_instants(const std::vector<Instant>& instants, const std::filesystem::path& file) {
  write_file(file, instant_columns().text(instants));
}

FileDescription file_columns(std::string file) { return instant_columns().describe(std::move(file)); }

}  // namespace tandem::modes
