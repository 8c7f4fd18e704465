#include <algorithm>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/comparison/models.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr double kYawRate = 0.3;  // rad/s

/// Words that set more than the motion model of the same name.
const std::string kModeB = "mode-b", kMultiHorizon = "multi-horizon";

/// What a model's parts after its first are called, and the values that they take besides a role.
struct PartName {
  std::string name, values{};
};
const std::vector<PartName> kParts = {{"non-holonomic"},   {"roll-pitch"}, {"surge", "MIN,MAX"},
                                      {"yaw-rate", "MAX"}, {"all"},        {"horizons", "LIST"}};

/// What may stand first.
std::vector<std::string> first_parts() {
  std::vector<std::string> names = model_names();
  names.insert(names.end(), {kModeB, kMultiHorizon});
  return names;
}

/// "name:a:b" as name, a, b.
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

/// The motion model that a part names, if it does.
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
    if (!takes_points(model)) options.mode = Mode::A;
    return true;
  }
  return false;
}

/// The role that ends a part, which it takes off.
Role take_role(const std::string& option, Part& part) {
  if (part.values.empty()) return Role::hard;
  const std::string last = part.values.back();
  if (last.empty() || parse_number(std::string_view(last).substr(0, last.find(',')))) return Role::hard;
  part.values.pop_back();
  return parse_limits(fmt::format("{} {}: the role", option, printable(part.text)), last);
}

void no_more(const std::string& option, const Part& part) {
  if (part.values.empty()) return;
  const auto known = std::find_if(kParts.begin(), kParts.end(), [&](const PartName& p) { return p.name == part.name; });
  const std::string values = known == kParts.end() ? "" : known->values;
  throw Error(fmt::format("{}: {} takes {}, not {}", option, part.name,
                          values.empty() ? "soft or hard alone" : values + " and soft or hard", quote(part.text)));
}

/// Adds constraints and horizons to a model.
class ModelParts {
 public:
  ModelParts(const std::string& option, const TrackingOptions& base, TrackingOptions& options)
      : option_(option), base_(base), options_(options) {}

  void add(Part part) {
    if (part.name == "horizons") {
      const std::size_t colon = part.text.find(':');  // its values have colons of their own
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
      throw Error(fmt::format("{} knows no {}{} (models begin: {}; then +{})", option_, quote(part.name),
                              did_you_mean(part.name, words), fmt::join(first, ", "), fmt::join(known, ", +")));
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
      options_.max_yaw_rate = !all && !part.values.empty() ? parse_magnitude(option_ + ": yaw-rate", take(part))
                                                           : base_.max_yaw_rate.value_or(kYawRate);
      limit(role);
    }
    no_more(option_, part);
  }

 private:
  static std::string take(Part& part) {
    const std::string value = part.values.front();
    part.values.erase(part.values.begin());
    return value;
  }
  void limit(Role role) {
    if (limits_ && *limits_ != role) throw Error(option_ + ": surge and yaw-rate are both soft or both hard");
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
  model.options.surge.reset();  // limits serve as numbers; a model has those that it names
  model.options.max_yaw_rate.reset();
  std::vector<std::string_view> parts = split(spec, '+');
  if (const Part first = part_of(parts.front()); set_motion(first, model.options)) {
    no_more(option, first);
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

Solver solver_for(const NamedModel& model) {
  const TrackingOptions& o = model.options;
  const bool limited = (o.surge || o.max_yaw_rate) && o.limits == Role::hard;
  if (o.roll_pitch == Role::hard || o.non_holonomic == Role::hard || limited) return AugmentedLagrangianOptions{};
  return GaussNewtonOptions{};
}

ModelResult try_model(const Scenario& scenario, const NamedModel& model, const Solver& solver) {
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
    result.usbl = summarise(estimated.errors, KeyframeType::usbl);
    result.optical = summarise(estimated.errors, KeyframeType::optical);
    result.gated = summarise(estimated.errors, KeyframeType::gated);
    result.all = summarise(estimated.errors);
  } catch (const Error& error) {
    result.status = "refused";
    result.message = error.what();
  }
  return result;
}

}  // namespace tandem
