#pragma once

#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <tandem/studies/support/file_description.hpp>
#include <tandem/studies/support/json_text.hpp>

namespace tandem {

/// The keys of a JSON object that shows one `T`. Each key has a description, from which docs/file_formats.md is
/// generated.
template <class T>
class JsonFields {
 public:
  using Json = nlohmann::ordered_json;

  /// Adds a key. `get(value)` returns any type that nlohmann::json converts; an empty optional omits the key.
  template <class F>
  JsonFields& add(std::string key, std::string doc, F get) {
    return add_field(std::move(key), std::move(doc), {}, [get](const T& value) { return json_of(get(value)); });
  }
  /// Adds a key with a nested object. `get(value)` returns a `U`, or an optional one; an empty optional omits the key.
  template <class U, class F>
  JsonFields& add_object(std::string key, std::string doc, JsonFields<U> fields, F get) {
    const auto nested = described(key + ".", fields.documented());
    return add_field(std::move(key), std::move(doc), nested,
                     [fields = std::move(fields), get](const T& value) -> std::optional<Json> {
                       const auto& object = get(value);
                       if constexpr (std::is_same_v<std::remove_cvref_t<decltype(object)>, std::optional<U>>)
                         return object ? std::optional(fields(*object)) : std::nullopt;
                       else
                         return fields(object);
                     });
  }
  /// Adds a key with an array of objects. `get(value)` returns a range of `U`.
  template <class U, class F>
  JsonFields& add_list(std::string key, std::string doc, JsonFields<U> fields, F get) {
    const auto nested = described(key + "[].", fields.documented());
    return add_field(std::move(key), std::move(doc), nested, [fields = std::move(fields), get](const T& value) {
      Json list = Json::array();
      for (const auto& entry : get(value)) list.push_back(fields(entry));
      return std::optional(std::move(list));
    });
  }
  /// Adds a key with an object whose keys are names, for example of sensors. `get(value)` returns a range of pairs of a
  /// name and a `U`; an empty range omits the key. `names` stands for the names in the documentation: "SENSOR".
  template <class U, class F>
  JsonFields& add_map(std::string key, const std::string& names, std::string doc, JsonFields<U> fields, F get) {
    const auto nested = described(key + "." + names + ".", fields.documented());
    return add_field(std::move(key), std::move(doc), nested,
                     [fields = std::move(fields), get](const T& value) -> std::optional<Json> {
                       Json map = Json::object();
                       for (const auto& [name, entry] : get(value)) map[std::string(name)] = fields(entry);
                       return map.empty() ? std::nullopt : std::optional(std::move(map));
                     });
  }
  /// Adds all keys of other fields. `get(value)` returns a `U`.
  template <class U, class F>
  JsonFields& add_all(const JsonFields<U>& fields, F get) {
    for (const auto& [key, doc] : fields.documented()) documented_.emplace_back(key, doc);
    writers_.push_back([fields, get](const T& value, Json& json) { json.update(fields(get(value))); });
    return *this;
  }

  /// Returns the object.
  Json operator()(const T& value) const {
    Json json = Json::object();
    for (const auto& write : writers_) write(value, json);
    return json;
  }

  /// Returns all keys with their descriptions. Nested keys are written as "errors.TYPE.n" and "solves[].cost".
  const std::vector<std::pair<std::string, std::string>>& documented() const { return documented_; }

 private:
  using Documented = std::vector<std::pair<std::string, std::string>>;

  JsonFields& add_field(std::string key, std::string doc, const Documented& nested,
                        std::function<std::optional<Json>(const T&)> get) {
    documented_.emplace_back(key, std::move(doc));
    documented_.insert(documented_.end(), nested.begin(), nested.end());
    writers_.push_back([key = std::move(key), get = std::move(get)](const T& value, Json& json) {
      if (auto field = get(value)) json[key] = std::move(*field);
    });
    return *this;
  }
  template <class V>
  static std::optional<Json> json_of(const V& value) {
    return Json(value);
  }
  template <class V>
  static std::optional<Json> json_of(const std::optional<V>& value) {
    return value ? std::optional(Json(*value)) : std::nullopt;
  }
  static Documented described(const std::string& prefix, Documented nested) {
    for (auto& [key, doc] : nested) key = prefix + key;
    return nested;
  }

  Documented documented_;
  std::vector<std::function<void(const T&, Json&)>> writers_;
};

/// Returns the value of the key "schema", the first of every JSON document: "tandem.COMMAND/1". The version increases
/// if a key is removed or changes its meaning.
inline std::string json_schema(const std::string& command) { return "tandem." + command + "/1"; }

/// Returns a JSON document of a command: its schema, then the fields of `value`.
template <class T>
nlohmann::ordered_json json_document(const std::string& command, const JsonFields<T>& fields, const T& value) {
  nlohmann::ordered_json json = {{"schema", json_schema(command)}};
  json.update(fields(value));
  return json;
}

/// Returns the description of a JSON document.
template <class T>
FileDescription describe_json(const std::string& file, const std::string& command, const JsonFields<T>& fields) {
  FileDescription description{
      file, "key", {{"schema", "\"" + json_schema(command) + "\": command and version of the keys"}}};
  for (const auto& field : fields.documented()) description.columns.push_back(field);
  return description;
}

}  // namespace tandem
