#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/residuals/loss_names.hpp>
#include <tandem/solvers/option_fields.hpp>
#include <tandem/studies/support/option_values.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

template <class T>
T choose(const std::string& option, const std::string& text, const std::vector<NamedValue<T>>& choices) {
  std::vector<std::string> names;
  for (const auto& [name, value] : choices) {
    if (name == text) return value;
    names.emplace_back(name);
  }
  throw Error(
      fmt::format("{} takes {}, not {}{}", option, listed(names, "or"), quote(text), did_you_mean(text, names)));
}

const std::vector<NamedValue<Loss::Kind>>& losses() {
  static const std::vector<NamedValue<Loss::Kind>> all = [] {
    std::vector<NamedValue<Loss::Kind>> choices;
    for (const auto& [kind, name] : kLossNames) choices.push_back({name.data(), kind});
    return choices;
  }();
  return all;
}

double parse_number(const std::string& option, std::string_view text) {
  const auto value = tandem::parse_number(text);
  if (!value || std::isnan(*value)) throw Error(fmt::format("{}: {} is not a number", option, quote(text)));
  return *value;
}

}  // namespace

Role parse_role(const std::string& option, const std::string& text) {
  return choose<Role>(option, text, {{"soft", Role::soft}, {"hard", Role::hard}, {"off", Role::off}});
}

Role parse_limits(const std::string& option, const std::string& text) {
  return choose<Role>(option, text, {{"hard", Role::hard}, {"soft", Role::soft}});
}

Mode parse_mode(const std::string& option, const std::string& text) {
  return choose<Mode>(option, text, {{"A", Mode::A}, {"B", Mode::B}});
}

MotionModel parse_model(const std::string& option, const std::string& text) {
  std::vector<NamedValue<MotionModel>> choices;
  for (const MotionModel model : motion_models) choices.push_back({name(model).data(), model});
  return choose<MotionModel>(option, text, choices);
}

std::vector<std::string> model_names() {
  std::vector<std::string> names;
  for (const MotionModel model : motion_models) names.emplace_back(name(model));
  return names;
}

Junction parse_junction(const std::string& option, const std::string& text) {
  return choose<Junction>(option, text, {{"boundary", Junction::boundary}, {"direct", Junction::direct}});
}

std::vector<Horizon> parse_horizons(const std::string& option, const std::string& text) {
  std::vector<Horizon> horizons;
  for (const std::string_view part : split(text, ',')) {
    const auto ends = split(part, ':');
    const auto back = parse_positive_integer(ends.front()), ahead = parse_positive_integer(ends.back());
    if (ends.size() > 2 || !back || !ahead)
      throw Error(
          fmt::format("{} takes a list of N or BACK:AHEAD in keyframes, e.g. 1,2,5:3, not {}", option, quote(part)));
    horizons.push_back({*back, *ahead});
  }
  return horizons;
}

Hessian parse_hessian(const std::string& option, const std::string& text) {
  return choose<Hessian>(option, text, {std::begin(kHessians), std::end(kHessians)});
}

IpoptLinearSolver parse_linear_solver(const std::string& option, const std::string& text) {
  static_assert(kIpoptLinearSolvers[0].value == IpoptLinearSolver::automatic);  // the default, not a choice
  return choose<IpoptLinearSolver>(option, text, {std::begin(kIpoptLinearSolvers) + 1, std::end(kIpoptLinearSolvers)});
}

std::optional<PlotFormat> parse_plots(const std::string& option, const std::string& text) {
  return choose<std::optional<PlotFormat>>(
      option, text, {{"svg", PlotFormat::svg}, {"png", PlotFormat::png}, {"pdf", PlotFormat::pdf}, {"off", {}}});
}

Bounds<1> parse_interval(const std::string& option, const std::string& text) {
  const auto parts = split(text, ',');
  if (parts.size() != 2)
    throw Error(fmt::format("{} takes two numbers MIN,MAX, not {}; for one limit: {} MIN,inf or {} -inf,MAX", option,
                            quote(text), option, option));
  const double lower = parse_number(option, parts[0]);
  const double upper = parse_number(option, parts[1]);
  if (lower > upper)
    throw Error(fmt::format("{}: the lower limit {} is above the upper limit {}", option, lower, upper));
  if (!std::isfinite(lower) && !std::isfinite(upper))
    throw Error(fmt::format("{} {} limits nothing; give at least one finite number", option, text));
  return between(lower, upper);
}

Loss parse_loss(const std::string& option, const std::string& text) {
  const std::size_t colon = text.find(':');
  Loss loss;
  loss.kind = choose<Loss::Kind>(option, text.substr(0, colon), losses());
  if (colon == std::string::npos) return loss;
  loss.scale = parse_number(option, std::string_view(text).substr(colon + 1));
  if (!std::isfinite(loss.scale) || loss.scale <= 0.0)
    throw Error(fmt::format("{}: the scale must be positive and finite, not {}", option, loss.scale));
  return loss;
}

std::vector<std::string> loss_names() {
  std::vector<std::string> names;
  for (const auto& [name, kind] : losses()) names.push_back(name);
  return names;
}

std::string loss_text(const Loss& loss) {
  const auto named =
      std::find_if(losses().begin(), losses().end(), [&](const auto& of) { return of.value == loss.kind; });
  return loss.kind == Loss::Kind::none ? named->name : fmt::format("{}:{}", named->name, loss.scale);
}

AnySolver parse_solver(const std::string& option, const std::string& text) {
  const std::vector<std::string> names = solver_names();
  if (std::find(names.begin(), names.end(), text) == names.end()) {
    if (nlopt_algorithms().empty() && text.starts_with("nlopt"))
      throw Error(fmt::format("{} {}: this build has no NLopt (available: {})", option, text, listed(names)));
    throw Error(
        fmt::format("{} takes {}, not {}{}", option, listed(names, "or"), quote(text), did_you_mean(text, names)));
  }
  if (text == "gauss-newton") return GaussNewtonOptions{};
  if (text == "augmented-lagrangian") return AugmentedLagrangianOptions{};
  if (text == "ipopt") return IpoptOptions{};
  NloptOptions options;
  options.algorithm = text.substr(text.find(':') + 1);
  return options;
}

int parse_count(const std::string& option, const std::string& text) {
  const auto value = parse_positive_integer(text);
  if (!value) throw Error(fmt::format("{} takes a positive integer, not {}", option, quote(text)));
  return *value;
}

int parse_count_or_zero(const std::string& option, const std::string& text) {
  if (text == "0") return 0;
  const auto value = parse_positive_integer(text);
  if (!value) throw Error(fmt::format("{} takes a non-negative integer, not {}", option, quote(text)));
  return *value;
}

double parse_non_negative(const std::string& option, const std::string& text) {
  const double value = parse_number(option, text);
  if (!std::isfinite(value) || value < 0.0)
    throw Error(fmt::format("{} takes a non-negative number, not {}", option, quote(text)));
  return value;
}

double parse_positive(const std::string& option, const std::string& text) {
  const double value = parse_non_negative(option, text);
  if (value <= 0) throw Error(fmt::format("{} takes a positive number, not {}", option, quote(text)));
  return value;
}

double parse_finite(const std::string& option, const std::string& text) {
  const auto value = tandem::parse_number(text);
  if (!value || !std::isfinite(*value))
    throw Error(fmt::format("{} takes a finite number, not {}", option, quote(text)));
  return *value;
}

std::vector<double> parse_numbers(const std::string& option, const std::string& text) {
  std::vector<double> values;
  for (const std::string_view part : split(text, ',')) {
    const auto value = tandem::parse_number(part);
    if (!value) throw Error(fmt::format("{}: {} is not a number", option, quote(part)));
    values.push_back(*value);
  }
  return values;
}

std::pair<std::string, std::string> parse_assignment(const std::string& option, const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
    throw Error(fmt::format("{} takes KEY=VALUE, not {}", option, quote(text)));
  return {text.substr(0, equals), text.substr(equals + 1)};
}

}  // namespace tandem
