#include <algorithm>
#include <optional>
#include <set>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/studies/recording/message_type.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

constexpr int kMaxDepth = 16;

std::optional<Primitive> primitive(std::string_view name, bool ros1) {
  constexpr std::pair<std::string_view, Primitive> all[] = {
      {"bool", Primitive::boolean},  {"boolean", Primitive::boolean}, {"int8", Primitive::int8},
      {"uint8", Primitive::uint8},   {"octet", Primitive::uint8},     {"int16", Primitive::int16},
      {"uint16", Primitive::uint16}, {"int32", Primitive::int32},     {"uint32", Primitive::uint32},
      {"int64", Primitive::int64},   {"uint64", Primitive::uint64},   {"float32", Primitive::float32},
      {"float", Primitive::float32}, {"float64", Primitive::float64}, {"double", Primitive::float64},
      {"string", Primitive::string}};
  for (const auto& [known, type] : all)
    if (name == known) return type;
  if (name == "byte") return ros1 ? Primitive::int8 : Primitive::uint8;
  if (name == "char") return Primitive::uint8;
  if (ros1 && name == "time") return Primitive::time;
  if (ros1 && name == "duration") return Primitive::duration;
  const std::string shortened = short_type_name(std::string(name));
  if (!ros1 && shortened == "builtin_interfaces/Time") return Primitive::time;
  if (!ros1 && shortened == "builtin_interfaces/Duration") return Primitive::duration;
  return {};
}

/// The definitions of a bag's type, by name.
class DefinitionParser {
 public:
  DefinitionParser(const std::string& type, const std::string& text, bool ros1) : ros1_(ros1) {
    std::string name = short_type_name(type), body;
    if (("\n" + text).find("\n---\n") != std::string::npos) throw Error("it is a service, not a message");
    for (const std::string_view line : split(text, '\n')) {
      if (line.starts_with("====")) {
        texts_.emplace(name, body);
        body.clear();
      } else if (line.starts_with("MSG: ") || line.starts_with("IDL: ")) {
        name = short_type_name(std::string(trimmed(line.substr(5))));
      } else {
        body += line;
        body += '\n';
      }
    }
    texts_.emplace(name, body);
  }

  std::shared_ptr<const MessageType> type(const std::string& name, int depth = 0) {
    if (depth > kMaxDepth) throw Error(fmt::format("the definition of {} refers to itself", name));
    if (const auto known = types_.find(name); known != types_.end()) return known->second;
    const auto text = texts_.find(name);
    if (text == texts_.end()) throw Error(fmt::format("the definition of {} is missing", name));
    auto type = std::make_shared<MessageType>(MessageType{name, {}});
    const std::string package = name.substr(0, name.find('/'));
    for (const std::string_view line : split(text->second, '\n'))
      if (auto member = parse_member(line, package, depth)) type->members.push_back(std::move(*member));
    types_[name] = type;
    return type;
  }

 private:
  std::optional<MessageMember> parse_member(std::string_view line, const std::string& package, int depth) {
    line = trimmed(line.substr(0, line.find('#')));
    if (line.empty()) return {};
    const std::size_t blank = line.find_first_of(" \t");
    if (blank == std::string_view::npos) return {};
    std::string_view type = line.substr(0, blank), rest = trimmed(line.substr(blank));
    const std::size_t end = rest.find_first_of(" \t=");
    MessageMember member{std::string(rest.substr(0, end))};
    if (end != std::string_view::npos && trimmed(rest.substr(end)).starts_with('=')) return {};  // a constant
    if (const std::size_t open = type.find('['); open != std::string_view::npos) {
      const std::string_view size = type.substr(open + 1, type.find(']') - open - 1);
      const auto length = parse_positive_integer(size);
      member.array = length ? MessageMember::Array::fixed : MessageMember::Array::sequence;  // also "<=N"
      if (length) member.length = static_cast<std::size_t>(*length);
      type = type.substr(0, open);
    }
    if (const std::size_t bound = type.find("<="); bound != std::string_view::npos) type = type.substr(0, bound);
    if (type == "wstring") throw Error("it has a member of type wstring, which is not supported");
    if (const auto known = primitive(type, ros1_)) {
      member.type = *known;
      return member;
    }
    member.message = this->type(qualified(short_type_name(std::string(type)), package), depth + 1);
    return member;
  }

  std::string qualified(const std::string& type, const std::string& package) const {
    if (type.find('/') != std::string::npos) return type;
    if (type == "Header") return "std_msgs/Header";
    return package + "/" + type;
  }

  bool ros1_;
  std::map<std::string, std::string> texts_;
  std::map<std::string, std::shared_ptr<const MessageType>> types_;
};

}  // namespace

std::string short_type_name(std::string type) {
  for (const char* middle : {"/msg/", "::msg::dds_::", "::msg::"})
    if (const std::size_t at = type.find(middle); at != std::string::npos)
      type.replace(at, std::string_view(middle).size(), "/");
  if (type.ends_with('_')) type.pop_back();
  return type;
}

std::shared_ptr<const MessageType> parse_message_definition(const std::string& type, const std::string& text,
                                                            bool ros1) {
  return DefinitionParser(type, text, ros1).type(short_type_name(type));
}

std::size_t size_of(Primitive type) {
  switch (type) {
    case Primitive::boolean:
    case Primitive::int8:
    case Primitive::uint8:
      return 1;
    case Primitive::int16:
    case Primitive::uint16:
      return 2;
    case Primitive::int32:
    case Primitive::uint32:
    case Primitive::float32:
      return 4;
    case Primitive::int64:
    case Primitive::uint64:
    case Primitive::float64:
    case Primitive::time:
    case Primitive::duration:
      return 8;
    case Primitive::string:
    case Primitive::chars:
    case Primitive::message:
      return 0;
  }
  return 0;
}

}  // namespace tandem
