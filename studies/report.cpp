#include <cmath>
#include <fstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <tandem/lie/error.hpp>
#include <tandem/studies/report.hpp>

namespace tandem {
namespace {

using Json = nlohmann::ordered_json;

struct Row {
  std::string name;
  ErrorSummary errors;
};

std::vector<Row> rows(const Estimate& estimate) {
  std::vector<Row> result;
  for (const KeyframeType type : {KeyframeType::usbl, KeyframeType::optical, KeyframeType::gated})
    result.push_back({std::string(name(type)), summarise(estimate.errors, type)});
  result.push_back({"all", summarise(estimate.errors)});
  return result;
}

std::string shown(const std::optional<MeanStd>& spread, int decimals) {
  return spread ? fmt::format("{:.{}f} ± {:.{}f}", spread->mean, decimals, spread->std, decimals) : "–";
}

std::string mean_shown(const std::optional<MeanStd>& spread, int decimals) {
  return spread ? fmt::format("{:.{}f}", spread->mean, decimals) : "–";
}

Json errors_json(const ErrorSummary& errors) {
  Json json = {{"n", errors.n}};
  if (errors.compared > 0 && errors.compared < errors.n) json["n_with_truth"] = errors.compared;
  const auto add = [&](const std::string& key, const std::string& unit, const std::optional<MeanStd>& spread) {
    if (!spread) return;
    json[key + "_mean_" + unit] = spread->mean;
    json[key + "_std_" + unit] = spread->std;
  };
  add("position", "m", errors.position);
  add("angle", "deg", errors.angle);
  add("raw_position", "m", errors.raw_position);
  add("raw_angle", "deg", errors.raw_angle);
  return json;
}

void write(const std::filesystem::path& file, const std::string& text) {
  std::ofstream stream(file, std::ios::binary);
  stream << text;
  stream.close();
  if (!stream) throw Error(fmt::format("{} cannot be written", file.string()));
}

std::string tum(const std::vector<Keyframe>& keyframes, const std::vector<SE3>& poses) {
  std::string text = "# t[s] x[m] y[m] z[m] qx qy qz qw\n";
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Vector<3> t = poses[k].translation();
    const SO3::Quaternion& q = poses[k].rotation().quaternion();
    text += fmt::format("{} {} {} {} {} {} {} {}\n", keyframes[k].t, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  }
  return text;
}

std::string errors_csv(const std::vector<KeyframeError>& errors) {
  const auto field = [](const std::optional<double>& value) { return value ? fmt::format("{}", *value) : ""; };
  std::string text = "t,type,position_error_m,angle_error_deg\n";
  for (const KeyframeError& error : errors)
    text += fmt::format("{},{},{},{}\n", error.t, name(error.type), field(error.position), field(error.angle));
  return text;
}

}  // namespace

std::string report(const Estimate& estimate) {
  const Summary& summary = estimate.summary;
  std::string text = fmt::format("{}, mode {}: {} keyframes, {} residual blocks", estimate.scenario, estimate.mode,
                                 estimate.keyframes.size(), estimate.residual_blocks);
  if (estimate.hard_blocks > 0) text += fmt::format(", {} hard constraints", estimate.hard_blocks);
  text += fmt::format("\n{}: {}, cost {:.6f} (from {:.6g}), {} iterations, {} evaluations, {:.3f} s\n", summary.solver,
                      name(summary.status), summary.cost, summary.initial_cost, summary.iterations, summary.evaluations,
                      summary.seconds);
  if (estimate.hard_blocks > 0)
    text += fmt::format("largest violation of a hard constraint: {:.2g}\n", summary.max_violation);
  if (!summary.converged()) text += fmt::format("NOT CONVERGED: {}\n", summary.message);

  const auto line = [](const auto&... cells) {
    return fmt::format("{:<10} {:>6}   {:>17}   {:>15}   {:>17}\n", cells...);
  };
  text += "\n" + line("keyframes", "n", "position [m]", "orientation [°]", "raw position [m]");
  for (const auto& [name, errors] : rows(estimate)) {
    // Beside the mean of all keyframes, one over those that have a measurement would mislead.
    const bool comparable = errors.raw_position && errors.raw_position->n == errors.compared;
    text += line(name, errors.n, shown(errors.position, 3), mean_shown(errors.angle, 2),
                 comparable ? shown(errors.raw_position, 3) : shown({}, 3));
  }
  const ErrorSummary all = summarise(estimate.errors);
  if (all.compared == 0)
    text += "There is no truth to compare with.\n";
  else if (all.compared < all.n)
    text += fmt::format("The truth covers {} of the {} keyframes.\n", all.compared, all.n);
  return text;
}

std::string summary_json(const Estimate& estimate) {
  const Summary& summary = estimate.summary;
  Json json = {{"scenario", estimate.scenario},
               {"mode", estimate.mode},
               {"solver", summary.solver},
               {"status", name(summary.status)},
               {"message", summary.message},
               {"initial_cost", summary.initial_cost},
               {"cost", summary.cost},
               {"keyframes", estimate.keyframes.size()},
               {"residual_blocks", estimate.residual_blocks},
               {"iterations", summary.iterations},
               {"evaluations", summary.evaluations},
               {"solve_seconds", summary.seconds},
               {"max_violation", summary.max_violation}};
  for (const auto& [name, errors] : rows(estimate)) json["errors"][name] = errors_json(errors);
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";  // a name may hold bytes that are no UTF-8
}

void write_results(const Estimate& estimate, const std::filesystem::path& folder) {
  write(folder / "chaser.tum", tum(estimate.keyframes, estimate.chaser));
  write(folder / "target.tum", tum(estimate.keyframes, estimate.target));
  write(folder / "errors.csv", errors_csv(estimate.errors));
  write(folder / "summary.json", summary_json(estimate));
}

}  // namespace tandem
