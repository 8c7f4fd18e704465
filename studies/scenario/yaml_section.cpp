#include <algorithm>
#include <cctype>
#include <cmath>
#include <istream>
#include <set>
#include <streambuf>

#include <fmt/format.h>

#include <tandem/lie/error.hpp>
#include <tandem/problem/stop.hpp>
#include <tandem/studies/scenario/yaml_section.hpp>
#include <tandem/studies/support/console.hpp>
#include <tandem/studies/support/input_file.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {

/// A text that is read in pieces. An interrupt between two pieces throws Stopped, since large files parse for long. The
/// first piece never throws: yaml-cpp's constructor reads it and would leak its buffer.
class InterruptibleText : public std::streambuf {
 public:
  InterruptibleText(const std::string& text, const std::filesystem::path& file) : text_(text), file_(file) {}

 protected:
  int_type underflow() override {
    constexpr std::size_t kPiece = 1 << 12;
    if (at_ == text_.size()) return traits_type::eof();
    if (at_ > 0) Stop(&interrupted()).check("reading " + file_.string());
    char* const begin = const_cast<char*>(text_.data()) + at_;  // not written to
    const std::size_t size = std::min(kPiece, text_.size() - at_);
    setg(begin, begin, begin + size);
    at_ += size;
    return traits_type::to_int_type(*begin);
  }

 private:
  const std::string& text_;
  const std::filesystem::path& file_;
  std::size_t at_ = 0;
};

}  // namespace

std::string yaml_text(const std::string& text) {
  const auto plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '.' || c == '/' || c == '-' || c == '+';
  };
  const bool word = !text.empty() && std::all_of(text.begin(), text.end(), plain) && text[0] != '-' && text[0] != '.';
  static const std::set<std::string> reserved = {"true", "false", "null", "yes", "no", "on", "off", "y", "n"};
  if (word && !reserved.contains(lower_case(text))) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    if (static_cast<unsigned char>(c) < 0x20) {
      quoted += fmt::format("\\x{:02x}", static_cast<unsigned>(c));
    } else {
      quoted += c;
    }
  }
  return quoted + "\"";
}

YamlSection::YamlSection(std::filesystem::path file, std::string name, YAML::Node node)
    : file_(std::move(file)), name_(std::move(name)), node_(std::move(node)) {
  if (!node_.IsMap()) fail(fmt::format("{} must consist of KEY: VALUE entries", name_.empty() ? "the file" : name_));
  values_.reserve(node_.size());
  for (const auto& entry : node_) {  // yaml-cpp does not report repeated keys, and searches keys one by one
    if (!entry.first.IsScalar()) fail_at(entry.first.Mark(), "a key must be a word");
    if (!values_.emplace(entry.first.Scalar(), entry.second).second)
      fail_at(entry.first.Mark(), fmt::format("key {} is given twice", quote(entry.first.Scalar())));
  }
}

YamlSection YamlSection::load(const std::filesystem::path& file) { return parse(read_text(file), file); }

YamlSection YamlSection::parse(const std::string& text, const std::filesystem::path& file) {
  try {
    InterruptibleText buffer(text, file);
    std::istream stream(&buffer);
    stream.exceptions(std::ios::badbit);
    return YamlSection(file, "", YAML::Load(stream));
  } catch (const YAML::Exception& error) {
    throw Error(fmt::format("{}:{}: not valid yaml: {}", file.string(), error.mark.line + 1, printable(error.msg)));
  }
}

std::vector<std::string> YamlSection::keys() const {
  std::vector<std::string> result;
  for (const auto& entry : node_) result.push_back(entry.first.Scalar());
  return result;
}

void YamlSection::allow_only(const std::vector<std::string>& known) const {
  for (const std::string& key : keys())
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      const std::string in = name_.empty() ? "" : " in " + name_;
      fail(key, fmt::format("unknown key {}{}{}", quote(key), in, did_you_mean(key, known)));
    }
}

std::string YamlSection::text(const std::string& key) const {
  const YAML::Node value = require(key);
  if (!value.IsScalar()) fail(key, fmt::format("{} must be text", key));
  return value.Scalar();
}

std::vector<std::string> YamlSection::texts(const std::string& key) const {
  const YAML::Node value = require(key);
  if (!value.IsSequence()) return {text(key)};
  std::vector<std::string> result;
  for (const YAML::Node& entry : value) {
    if (!entry.IsScalar()) fail(key, fmt::format("{} must be a word or a list of words", key));
    result.push_back(entry.Scalar());
  }
  return result;
}

double YamlSection::number(const std::string& key) const { return finite(key, require(key)); }

bool YamlSection::boolean(const std::string& key) const {
  const std::string value = text(key);
  if (value != "true" && value != "false")
    fail(key, fmt::format("{} must be true or false, not {}", key, quote(value)));
  return value == "true";
}

std::vector<double> YamlSection::numbers(const std::string& key) const {
  const YAML::Node value = require(key);
  if (!value.IsSequence()) return {finite(key, value)};
  std::vector<double> result;
  for (const YAML::Node& entry : value) result.push_back(finite(key, entry));
  return result;
}

std::vector<double> YamlSection::numbers(const std::string& key, std::size_t count) const {
  if (require(key).IsNull()) fail(key, fmt::format("{} needs {} numbers, but is empty", key, count));
  const std::vector<double> values = numbers(key);
  if (values.size() != count) fail(key, fmt::format("{} needs {} numbers, not {}", key, count, values.size()));
  return values;
}

YamlSection YamlSection::section(const std::string& key) const {
  const std::string in = name_ == "sensors" ? "sensor " : name_.empty() ? "" : name_ + " ";
  return YamlSection(file_, in + key, require(key));
}

void YamlSection::fail(const std::string& key, const std::string& reason) const {
  for (const auto& entry : node_)
    if (entry.first.Scalar() == key) fail_at(entry.first.Mark(), reason);
  fail(reason);
}

void YamlSection::fail(const std::string& reason) const { fail_at(node_.Mark(), reason); }

YAML::Node YamlSection::require(const std::string& key) const {
  const auto value = values_.find(key);
  if (value == values_.end()) fail(fmt::format("{} lacks the key {}", name_.empty() ? "the file" : name_, key));
  return value->second;
}

double YamlSection::finite(const std::string& key, const YAML::Node& value) const {
  if (!value.IsScalar()) fail(key, fmt::format("{} must be a number", key));
  const double number = parse_number(value.Scalar()).value_or(std::nan(""));
  if (!std::isfinite(number)) fail(key, fmt::format("{} is {}, not a finite number", key, quote(value.Scalar())));
  return number;
}

std::string YamlSection::line(const std::string& key) const {
  YAML::Emitter emitter;
  emitter.SetSeqFormat(YAML::Flow);
  emitter.SetMapFormat(YAML::Flow);
  emitter << require(key);
  std::string text = emitter.c_str();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

std::string YamlSection::place(const std::string& key) const {
  for (const auto& entry : node_)
    if (entry.first.Scalar() == key) return place_of(entry.first.Mark());
  return place_of(node_.Mark());
}

std::string YamlSection::place_of(const YAML::Mark& mark) const {
  return fmt::format("{}:{}", file_.string(), std::max(mark.line, 0) + 1);
}

void YamlSection::fail_at(const YAML::Mark& mark, const std::string& reason) const {
  throw Error(fmt::format("{}: {}", place_of(mark), printable(reason)));
}

}  // namespace tandem
