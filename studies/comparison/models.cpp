#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/comparison/models.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr double kYawRate = 0.3;  // default limit [rad/s]

/// Names of the first part of a specification that set more options than the motion model.
const std::string kModeB = "mode-b", kMultiHorizon = "multi-horizon";

/// A constraint or horizons: its name, and the values that it takes besides a role.
struct PartName {
  std::string name, values{};
};
const std::vector<PartName> kParts = {{"non-holonomic"},   {"roll-pitch"}, {"surge", "MIN,MAX"},
                                      {"yaw-rate", "MAX"}, {"all"},        {"horizons", "LIST"}};

/// Returns the words that may be the first part of a specification.
std::vector<std::string> first_parts() {
  std::vector<std::string> names = model_names();
  names.insert(names.end(), {kModeB, kMultiHorizon});
  return names;
}

/// A parsed part "NAME:VALUE:…" of a specification.
struct Part {
  std::string text, name;
  std::vector<std::string> values;
};

Part part_of(std::string_view text) {
  Part part{std::string(text), {}, {}};
  for (const std::string_view piece : split(text, ':')) part.values.emplace_back(piece);
  part.name = part.values.front();
  part.values.erase(part.values.begin());
  return part;
}

/// Sets the motion model that a part names; returns false if it names none.
bool set_motion(const Part& part, TrackingOptions& options) {
  if (part.name == kModeB) {
    options.mode = Mode::B;
    options.model = MotionModel::constant_twist;
    return true;
  }
  if (part.name == kMultiHorizon) {
    options.model = MotionModel::constant_twist;
    options.horizons = {{1, 1}, {2, 2}, {4, 4}};
    return true;
  }
  for (const MotionModel model : motion_models) {
    if (part.name != name(model)) continue;
    options.model = model;
    if (!supports_points(model)) options.mode = Mode::A;
    return true;
  }
  return false;
}

/// Removes the role from the end of a part and returns it; hard if there is none.
Role take_role(const std::string& option, Part& part) {
  if (part.values.empty()) return Role::hard;
  const std::string last = part.values.back();
  if (last.empty() || parse_number(std::string_view(last).substr(0, last.find(',')))) return Role::hard;
  part.values.pop_back();
  return parse_limits(fmt::format("{} {}: the role", option, printable(part.text)), last);
}

/// Throws Error if a part has more values than its name takes.
void check_no_values_left(const std::string& option, const Part& part) {
  if (part.values.empty()) return;
  const auto known = std::find_if(kParts.begin(), kParts.end(), [&](const PartName& p) { return p.name == part.name; });
  const std::string values = known == kParts.end() ? "" : known->values;
  throw Error(fmt::format("{}: {} takes {}, not {}", option, part.name,
                          values.empty() ? "only soft or hard" : values + " and soft or hard", quote(part.text)));
}

/// Adds constraints and horizons to the options of a model.
class ModelParts {
 public:
  ModelParts(const std::string& option, const TrackingOptions& base, TrackingOptions& options)
      : option_(option), base_(base), options_(options) {}

  void add(Part part) {
    if (part.name == "horizons") {
      const std::size_t colon = part.text.find(':');  // the values may contain colons, too
      options_.horizons = parse_horizons(fmt::format("{}: horizons", option_),
                                         colon == std::string::npos ? "" : part.text.substr(colon + 1));
      return;
    }
    std::vector<std::string> known;
    for (const PartName& p : kParts) known.push_back(p.name);
    if (std::find(known.begin(), known.end(), part.name) == known.end()) {
      const std::vector<std::string> first = first_parts();
      std::vector<std::string> words = known;
      words.insert(words.end(), first.begin(), first.end());
      throw Error(fmt::format("{}: unknown model or constraint {}{} (models: {}; constraints: +{})", option_,
                              quote(part.name), did_you_mean(part.name, words), fmt::join(first, ", "),
                              fmt::join(known, ", +")));
    }
    const Role role = take_role(option_, part);
    const bool all = part.name == "all";
    if (all || part.name == "non-holonomic") options_.non_holonomic = role;
    if (all || part.name == "roll-pitch") options_.roll_pitch = role;
    if (all || part.name == "surge") {
      options_.surge = !all && !part.values.empty() ? parse_interval(option_ + ": surge", take(part))
                       : base_.surge                ? *base_.surge
                                                    : Bounds<1>(at_least(0));
      limit(role);
    }
    if (all || part.name == "yaw-rate") {
      options_.max_yaw_rate = !all && !part.values.empty() ? parse_non_negative(option_ + ": yaw-rate", take(part))
                                                           : base_.max_yaw_rate.value_or(kYawRate);
      limit(role);
    }
    check_no_values_left(option_, part);
  }

 private:
  static std::string take(Part& part) {
    const std::string value = part.values.front();
    part.values.erase(part.values.begin());
    return value;
  }
  void limit(Role role) {
    if (limits_ && *limits_ != role) throw Error(option_ + ": surge and yaw-rate must be both soft or both hard");
    limits_ = options_.limits = role;
  }

  const std::string& option_;
  const TrackingOptions& base_;
  TrackingOptions& options_;
  std::optional<Role> limits_;
};

}  // namespace

std::vector<std::string> default_models() {
  std::vector<std::string> names = {"constant-twist", "mode-b",          "constant-velocity",        "multi-horizon",
                                    "damped-twist",   "damped-velocity", "white-noise-acceleration", "steady-course"};
  for (const char* constraint : {"non-holonomic", "surge", "yaw-rate"})
    for (const char* role : {"soft", "hard"}) names.push_back(fmt::format("{}:{}", constraint, role));
  for (const char* last : {"roll-pitch:hard", "all:soft", "all:hard"}) names.emplace_back(last);
  return names;
}

std::string model_spec_words() {
  std::vector<std::string> parts;
  for (const auto& [name, values] : kParts) parts.push_back(values.empty() ? name : name + ":" + values);
  return fmt::format("MODEL: {} (default {}). CONSTRAINT: {}.", listed(first_parts(), "or"),
                     name(MotionModel::constant_twist), listed(parts, "or"));
}

NamedModel parse_model_spec(const std::string& option, const std::string& spec, const TrackingOptions& base) {
  NamedModel model{spec, base};
  model.options.surge.reset();  // the limits of `base` apply only if the specification names the constraint
  model.options.max_yaw_rate.reset();
  std::vector<std::string_view> parts = split(spec, '+');
  if (const Part first = part_of(parts.front()); set_motion(first, model.options)) {
    check_no_values_left(option, first);
    parts.erase(parts.begin());
  }
  ModelParts add(option, base, model.options);
  for (const std::string_view part : parts) add.add(part_of(part));
  return model;
}

std::vector<NamedModel> parse_model_list(const std::string& option, const std::string& text,
                                         const TrackingOptions& base) {
  std::vector<std::string> specs;
  for (const std::string_view word : split(text, ',')) {
    const std::string_view number = word.substr(0, word.find_first_of(":+"));
    if (!specs.empty() && parse_number(number))
      specs.back() += "," + std::string(word);
    else
      specs.emplace_back(word);
  }
  std::vector<NamedModel> models;
  for (const std::string& spec : specs) models.push_back(parse_model_spec(option, spec, base));
  return models;
}

AnySolver solver_for(const NamedModel& model) {
  const TrackingOptions& o = model.options;
  const bool limited = (o.surge || o.max_yaw_rate) && o.limits == Role::hard;
  if (o.roll_pitch == Role::hard || o.non_holonomic == Role::hard || limited) return AugmentedLagrangianOptions{};
  return GaussNewtonOptions{};
}

ModelResult evaluate_model(const Scenario& scenario, const NamedModel& model, const AnySolver& solver) {
  ModelResult result;
  result.name = model.name;
  try {
    const Estimate estimated = estimate(scenario, model.options, solver, false, {}, false);
    const Summary& summary = estimated.summary;
    result.solver = summary.solver;
    result.status = name(summary.status);
    result.message = summary.message;
    result.solved = true;
    result.cost = summary.cost;
    result.violation = summary.max_violation;
    result.seconds = summary.seconds;
    result.iterations = summary.iterations;
    for (std::size_t i = 0; i < keyframe_types.size(); ++i)
      result.errors[i] = summarise(estimated.errors, keyframe_types[i]);
    result.all = summarise(estimated.errors);
  } catch (const Error& error) {
    result.status = "refused";
    result.message = error.what();
  }
  return result;
}

}  // namespace tandem
