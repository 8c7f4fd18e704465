#include <cctype>

#include <CLI/CLI.hpp>

#include <tandem/lie/error.hpp>
#include <tandem/studies/commands/command_options.hpp>

namespace tandem {
namespace {

/// Returns the long form of "-o,--out".
std::string long_name(const std::string& name) { return name.substr(name.find(',') + 1); }

/// Adds "; repeatable" to the first sentence.
std::string marked_repeatable(const std::string& help) {
  const std::size_t end = first_sentence(help).size();
  return help.substr(0, end) + "; repeatable" + help.substr(end);
}

}  // namespace

std::string_view first_sentence(std::string_view text) {
  for (std::size_t end = 0; (end = text.find(". ", end)) != text.npos; ++end)
    if (end + 2 < text.size() && (std::isupper(static_cast<unsigned char>(text[end + 2])) || text[end + 2] == '-'))
      return text.substr(0, end);
  return text;
}

std::string OptionInfo::key() const {
  const std::string name = long_name(this->name);
  return name.substr(std::min(name.size(), name.find_first_not_of('-')));
}

CommandOptions::CommandOptions(CLI::App& app) : app_(app) {}

void CommandOptions::argument(const std::string& name, const std::string& takes, const std::string& help,
                              std::string& value) {
  infos_.push_back({name, takes, help, "", false, true, true, false});
  app_.add_option(name, value, help)->type_name(takes)->required();
}

void CommandOptions::arguments(const std::string& name, const std::string& takes, const std::string& help,
                               std::vector<std::string>& values) {
  infos_.push_back({name, takes, help, "", false, true, false, true});
  app_.add_option(name, values, help)->type_name(takes);
}

void CommandOptions::add_option(const std::string& name, const std::string& takes, const std::string& help, Times times,
                                Set set) {
  infos_.push_back({name, takes, times == Times::any ? marked_repeatable(help) : help, group_, advanced_, false,
                    times == Times::required, times == Times::any});
  // CLI11 calls this while it parses, before it detects unknown options. The values are parsed later.
  const auto later = [this, option = long_name(name), set = std::move(set)](const std::vector<std::string>& values) {
    reads_.emplace_back([this, option, set, values] {
      try {
        for (const std::string& text : values) set(option, text);
      } catch (const Error& error) {
        const auto place = places_.find(option.substr(2));
        if (place == places_.end()) throw;
        throw Error(place->second + ": " + error.what());
      }
    });
  };
  CLI::Option* const option = app_.add_option_function<std::vector<std::string>>(name, later, help);
  option->type_name(takes)->group(group_)->allow_extra_args(false);
  if (times != Times::any) option->expected(1);
  if (times == Times::required) option->required();
}

void CommandOptions::flag(const std::string& name, const std::string& help, bool& value) {
  flag(name, help, [&value] { value = true; });
}

void CommandOptions::flag(const std::string& name, const std::string& help, std::function<void()> set) {
  infos_.push_back({name, "", help, group_, advanced_, false, false, false});
  app_.add_flag_callback(
          name, [this, set = std::move(set)] { reads_.push_back(set); }, help)
      ->group(group_);
}

void CommandOptions::hidden(const std::string& name, std::string& value) { app_.add_option(name, value)->group(""); }

std::vector<std::string> CommandOptions::given(const std::string& heading) const {
  std::vector<std::string> names;
  for (const CLI::Option* option : app_.get_options())
    if (option->count() > 0 && option->get_group() == heading) names.push_back(option->get_name());
  return names;
}

std::vector<std::pair<OptionInfo, std::vector<std::string>>> CommandOptions::given() const {
  std::vector<std::pair<OptionInfo, std::vector<std::string>>> result;
  for (const OptionInfo& info : infos_)
    if (const CLI::Option* const option = app_.get_option_no_throw(info.positional ? info.name : long_name(info.name));
        option && option->count() > 0)
      result.emplace_back(info, option->results());
  return result;
}

void CommandOptions::read(std::vector<std::string> words) {
  words_ = std::move(words);
  for (const std::function<void()>& read : reads_) read();
  for (const std::function<void()>& check : checks_) check();
}

}  // namespace tandem
