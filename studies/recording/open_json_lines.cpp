#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <tandem/lie/error.hpp>
#include <tandem/studies/recording/recorded_time.hpp>
#include <tandem/studies/recording/recording_formats.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

using Json = nlohmann::json;

/// A value of a JSON object with the path to it: "transducers[0].velocity".
struct Leaf {
  std::string path;
  double number;
  std::string text;
};

void add_leaves(const Json& json, const std::string& path, std::vector<Leaf>& leaves) {
  const double nan = std::nan("");
  if (json.is_object())
    for (const auto& [key, value] : json.items()) add_leaves(value, path.empty() ? key : path + "." + key, leaves);
  else if (json.is_array())
    for (std::size_t i = 0; i < json.size(); ++i) add_leaves(json[i], fmt::format("{}[{}]", path, i), leaves);
  else if (json.is_number())
    leaves.push_back({path, json.get<double>(), ""});
  else if (json.is_boolean())
    leaves.push_back({path, json.get<bool>() ? 1.0 : 0.0, ""});
  else if (json.is_string())
    leaves.push_back({path, nan, json.get<std::string>()});
}

/// Units that Water Linked documents for its DVL; other sources state none.
std::string stated_unit(const std::string& type, const std::string& path) {
  if (type == "velocity" && path == "time") return "ms";  // since the last report
  if (type == "velocity" && (path == "time_of_validity" || path == "time_of_transmission")) return "us";
  return "";
}

/// A text file with a JSON object on each line, as of the DVL and UGPS of Water Linked. Objects with a key `type` are
/// streams by its value; others belong to a stream with the name of the file.
class JsonLinesRecording : public Recording {
 public:
  explicit JsonLinesRecording(const std::filesystem::path& file) {
    file_ = file;
    format_ = "JSON lines";
    std::size_t bad = 0, first_bad = 0;
    each_line([] {},
              [&](const Json& json, std::size_t line) {
                if (!json.is_object()) {
                  if (bad++ == 0) first_bad = line;
                  return;
                }
                count(json);
              });
    if (streams_.empty()) throw Error(fmt::format("{}: no line is a JSON object", file.string()));
    if (bad > 0)
      add_defect(fmt::format("{} lines are not JSON objects and are skipped; the first is line {}", bad, first_bad));
  }

  void read(const std::vector<RowRequest>& requests, const std::function<void()>& stop) override {
    std::vector<Leaf> leaves;
    std::vector<RecordedValue> values;
    each_line(stop, [&](const Json& json, std::size_t) {
      if (!json.is_object()) return;
      const std::string name = stream_name(json);
      leaves.clear();
      for (const RowRequest& request : requests) {
        if (request.stream != name) continue;
        if (leaves.empty()) add_leaves(json, "", leaves);
        values.clear();
        for (const std::string& field : request.fields) values.push_back(value(field, leaves));
        request.row({std::nan(""), values});
      }
    });
  }

 private:
  template <class F>
  void each_line(const std::function<void()>& stop, F f) const {
    InputFile stream(file_);
    std::string line;
    for (std::size_t n = 1; std::getline(stream, line); ++n) {
      if (n % 1024 == 0) stop();
      const std::size_t begin = line.find('{');  // a logger may have written a time in front
      if (trimmed(line).empty()) continue;
      f(begin == std::string::npos ? Json()
                                   : Json::parse(line.begin() + static_cast<long>(begin), line.end(), nullptr, false),
        n);
    }
  }

  std::string stream_name(const Json& json) const {
    const auto type = json.find("type");
    return type != json.end() && type->is_string() ? type->get<std::string>() : file_.stem().string();
  }

  static RecordedValue value(const std::string& field, const std::vector<Leaf>& leaves) {
    for (const Leaf& leaf : leaves)
      if (leaf.path == field) return {leaf.number, leaf.text};
    return {};
  }

  void count(const Json& json) {
    const std::string name = stream_name(json);
    auto stream = std::find_if(streams_.begin(), streams_.end(), [&](const auto& s) { return s.name == name; });
    std::vector<Leaf> leaves;
    add_leaves(json, "", leaves);
    if (stream == streams_.end()) {
      const bool water_linked = name == "velocity" || name == "position_local";
      stream = streams_.insert(streams_.end(), RecordedStream{name, water_linked ? "WaterLinked/" + name : ""});
      known_.emplace_back();
    }
    std::set<std::string>& known = known_[static_cast<std::size_t>(stream - streams_.begin())];
    for (const Leaf& leaf : leaves)
      if (known.insert(leaf.path).second) stream->fields.push_back({leaf.path, stated_unit(name, leaf.path)});
    if (stream->time_field.empty())
      for (const char* field : {"time_of_validity", "ts", "timestamp", "time", "stamp", "t"})
        if (stream->time_field.empty() && known.contains(field)) stream->time_field = field;
    ++stream->rows;
    const RecordedValue at = value(stream->time_field, leaves);
    const double t = seconds_by_magnitude(at.text.empty() ? at.number : parse_time_text(at.text).value_or(at.number));
    if (!(stream->first <= t)) stream->first = t;
    if (!(stream->last >= t)) stream->last = t;
  }

  std::vector<std::set<std::string>> known_;  ///< paths of each stream
};

}  // namespace

std::unique_ptr<Recording> open_json_lines(const std::filesystem::path& file) {
  return std::make_unique<JsonLinesRecording>(file);
}

}  // namespace tandem
