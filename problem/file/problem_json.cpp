#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <string_view>
#include <utility>

#include <nlohmann/json.hpp>

#include <tandem/problem/file/problem_json.hpp>
#include <tandem/residuals/loss_names.hpp>

namespace tandem::detail {
namespace {

using Json = nlohmann::ordered_json;
using Block = ProblemData::Block;
using Role = ProblemData::Role;

constexpr const char* kFormat = "tandem problem";
constexpr int kVersion = 1;

const std::pair<Role, std::string_view> kRoles[] = {{Role::cost, "cost"},
                                                    {Role::constraint, "constraint"},
                                                    {Role::marginal_prior, "marginal prior"},
                                                    {Role::marginal_constraint, "marginal constraint"}};

// Writing.

/// Infinite bounds become strings, because JSON has no infinity.
Json number(double x, bool bound, const std::string& what) {
  if (std::isfinite(x)) return x;
  if (std::isnan(x) || !bound) throw BadInputError(what + " contains a number that is not finite");
  return x > 0 ? "inf" : "-inf";
}

Json numbers(const std::vector<double>& x, const std::string& what, bool bounds = false) {
  Json list = Json::array();
  for (const double number : x) list.push_back(detail::number(number, bounds, what));
  return list;
}

Json matrix(const std::vector<double>& by_rows, std::size_t rows, const std::string& what) {
  Json list = Json::array();
  for (std::size_t r = 0, columns = rows ? by_rows.size() / rows : 0; r < rows; ++r) {
    const auto first = by_rows.begin() + std::ptrdiff_t(r * columns);
    list.push_back(numbers({first, first + std::ptrdiff_t(columns)}, what));
  }
  return list;
}

template <class Names, class Value>
std::string_view name_of(const Names& names, Value value) {
  for (const auto& [v, name] : names)
    if (v == value) return name;
  return "";
}

Json as_json(const Block& block, const std::string& what) {
  Json json;
  json["role"] = name_of(kRoles, block.role);
  if (ProblemData::is_marginal(block.role)) {
    json["variables"] = block.variables;
    json["A"] = matrix(block.A, block.b.size(), what);
    json["b"] = numbers(block.b, what);
    if (block.role == Role::marginal_prior) json["constant"] = number(block.constant, false, what);
    json["anchors"] = numbers(block.anchors, what);
    return json;
  }
  json["residual"] = block.residual;
  json["variables"] = block.variables;
  json["data"] = numbers(block.data, what, true);
  if (block.role == Role::constraint) {
    json["lower"] = numbers(block.lower, what, true);
    json["upper"] = numbers(block.upper, what, true);
    if (std::any_of(block.multipliers.begin(), block.multipliers.end(), [](double l) { return l != 0; }))
      json["multipliers"] = numbers(block.multipliers, what);
    return json;
  }
  if (block.full.empty()) {
    json["noise"]["diagonal"] = numbers(block.diagonal, what);
  } else {
    json["noise"]["full"] = matrix(block.full, std::size_t(std::lround(std::sqrt(double(block.full.size())))), what);
  }
  if (block.loss.kind != Loss::Kind::none)
    json["loss"] = {{"kind", name_of(kLossNames, block.loss.kind)}, {"scale", number(block.loss.scale, false, what)}};
  return json;
}

/// Serializes a value on one line. Invalid UTF-8 in names is replaced.
std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

template <class List, class F>
std::string lines(const List& list, F as_json) {
  std::string text = "[";
  for (std::size_t i = 0; i < list.size(); ++i) text += (i ? ",\n  " : "\n  ") + text_of(as_json(list[i], i));
  return text + "\n]";
}

// Reading.

/// Returns a short text of a value for a message.
std::string shown(const Json& json) {
  if (json.is_structured()) return json.is_array() ? "a list" : "an object";
  return json.dump(-1, ' ', true, Json::error_handler_t::replace).substr(0, 40);
}

/// An entry of the file and its location for messages.
struct Entry {
  const Json& json;
  std::string where;

  [[noreturn]] void fail(const std::string& why) const { throw BadInputError(where + " " + why); }
  bool has(const char* key) const { return json.contains(key); }
  Entry at(const char* key) const {
    const std::string there = where.empty() ? key : where + ": " + key;
    const auto found = json.find(key);
    if (found == json.end()) throw BadInputError(there + " is missing");
    return {*found, there};
  }
  /// Checks that the entry is an object with no other keys than these.
  const Entry& object(std::initializer_list<std::string_view> keys) const {
    if (!json.is_object()) fail("must be an object in braces");
    for (const auto& [key, value] : json.items())
      if (std::find(keys.begin(), keys.end(), key) == keys.end())
        fail("has an unknown entry \"" + key + "\"; remove it or correct its name");
    return *this;
  }
  const Json& list() const {
    if (!json.is_array()) fail("must be a list in brackets");
    return json;
  }
  std::string text() const {
    if (!json.is_string()) fail("must be a string");
    return json.get<std::string>();
  }
  bool flag() const {
    if (!json.is_boolean()) fail("must be true or false");
    return json.get<bool>();
  }
  int whole(const Json& x) const {
    if (!x.is_number_integer() || x.get<double>() < 0 || x.get<double>() > std::numeric_limits<int>::max())
      fail("accepts only integers from 0 up, not " + shown(x));
    return x.get<int>();
  }
  double number(const Json& x, bool bound = false) const {
    if (bound && x == "inf") return std::numeric_limits<double>::infinity();
    if (bound && x == "-inf") return -std::numeric_limits<double>::infinity();
    if (!x.is_number() || !std::isfinite(x.get<double>()))
      fail(std::string("accepts only finite numbers") + (bound ? ", \"inf\" and \"-inf\"" : "") + ", not " + shown(x));
    return x.get<double>();
  }
  std::vector<double> numbers(bool bounds = false) const {
    std::vector<double> result;
    for (const Json& x : list()) result.push_back(number(x, bounds));
    return result;
  }
  std::vector<double> matrix() const {
    std::vector<double> result;
    for (const Json& row : list()) {
      if (!row.is_array() || row.size() != json.front().size())
        fail("must have rows of equal length, each in brackets");
      for (const Json& x : row) result.push_back(number(x));
    }
    return result;
  }
  template <class Names>
  auto one_of(const Names& names) const {
    const std::string text = this->text();
    std::string known;
    for (const auto& [value, name] : names) {
      if (name == text) return value;
      known += (known.empty() ? "" : ", ") + std::string(name);
    }
    fail("must be one of " + known);
  }
};

Block block_of(const Entry& entry) {
  Block block;
  if (!entry.json.is_object()) entry.fail("must be an object in braces");
  block.role = entry.at("role").one_of(kRoles);
  const Entry variables = entry.at("variables");
  for (const Json& v : variables.list()) block.variables.push_back(variables.whole(v));
  if (ProblemData::is_marginal(block.role)) {
    const bool prior = block.role == Role::marginal_prior;
    if (prior) entry.object({"role", "variables", "A", "b", "constant", "anchors"});
    if (!prior) entry.object({"role", "variables", "A", "b", "anchors"});
    block.A = entry.at("A").matrix();
    block.b = entry.at("b").numbers();
    if (prior) block.constant = entry.at("constant").number(entry.at("constant").json);
    block.anchors = entry.at("anchors").numbers();
    return block;
  }
  block.residual = entry.at("residual").text();
  block.data = entry.at("data").numbers(true);
  if (block.role == Role::constraint) {
    entry.object({"role", "residual", "variables", "data", "lower", "upper", "multipliers"});
    block.lower = entry.at("lower").numbers(true);
    block.upper = entry.at("upper").numbers(true);
    block.multipliers.assign(block.lower.size(), 0.0);
    if (entry.has("multipliers")) block.multipliers = entry.at("multipliers").numbers();
    return block;
  }
  entry.object({"role", "residual", "variables", "data", "noise", "loss"});
  const Entry noise = entry.at("noise");
  noise.object({"diagonal", "full"});
  if (noise.has("diagonal") == noise.has("full")) noise.fail("must have either diagonal or full");
  if (noise.has("full")) {
    block.full = noise.at("full").matrix();
    if (block.full.empty()) noise.fail("has an empty matrix full");
  } else {
    block.diagonal = noise.at("diagonal").numbers();
  }
  if (entry.has("loss")) {
    const Entry loss = entry.at("loss");
    loss.object({"kind", "scale"});
    block.loss = {loss.at("kind").one_of(kLossNames), loss.at("scale").number(loss.at("scale").json)};
  }
  return block;
}

Json parsed(const std::string& text) try { return Json::parse(text); } catch (const Json::parse_error& error) {
  throw BadInputError("invalid JSON at byte " + std::to_string(error.byte) +
                      "; the file may be truncated, write the problem again");
} catch (const Json::exception& error) {
  throw BadInputError("a number exceeds the range of double precision");
}

}  // namespace

std::string json_text(const ProblemData& data) {
  std::string text = "{\n\"format\": " + text_of(kFormat) + ",\n\"version\": " + text_of(kVersion);
  text += ",\n\"loss_scale\": " + text_of(data.loss_scale);
  text += ",\n\"variables\": " + lines(data.variables, [](const ProblemData::Variable& v, std::size_t i) {
            Json json{{"group", v.group}, {"name", v.name}};
            json["value"] = numbers(v.value, "variable " + std::to_string(i) + " (" + v.name + ")");
            if (v.fixed) json["fixed"] = true;
            return json;
          });
  text += ",\n\"blocks\": " + lines(data.blocks, [](const Block& block, std::size_t i) {
            return as_json(block, "block " + std::to_string(i) + " (" + block.residual + ")");
          });
  return text + "\n}\n";
}

ProblemData parse_json(const std::string& text) {
  const Json json = parsed(text);
  const Entry file{json, ""};
  if (!json.is_object() || !file.has("format") || json["format"] != kFormat)
    throw BadInputError(std::string("not a problem file; \"format\" must be \"") + kFormat + "\"");
  if (const Entry version = file.at("version"); version.json != kVersion)
    throw BadInputError("format version " + shown(version.json) + " is not supported, only version " +
                        std::to_string(kVersion) + "; use the Tandem release that wrote the file");
  Entry{json, "the file"}.object({"format", "version", "loss_scale", "variables", "blocks"});
  ProblemData data;
  if (file.has("loss_scale")) data.loss_scale = file.at("loss_scale").number(json["loss_scale"]);
  for (const Json& variable : file.at("variables").list()) {
    const Entry entry{variable, "variable " + std::to_string(data.variables.size())};
    entry.object({"group", "name", "value", "fixed"});
    data.variables.push_back({entry.at("group").text(), entry.at("name").text(), entry.at("value").numbers(),
                              entry.has("fixed") && entry.at("fixed").flag()});
  }
  for (const Json& block : file.at("blocks").list())
    data.blocks.push_back(block_of({block, "block " + std::to_string(data.blocks.size())}));
  return data;
}

}  // namespace tandem::detail
