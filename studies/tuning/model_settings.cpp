#include <fmt/format.h>

#include <tandem/studies/tuning/model_settings.hpp>

namespace tandem {

std::map<std::string, std::vector<std::string>> option_values(const ModelSettings& settings) {
  std::map<std::string, std::vector<std::string>> values;
  for (const auto& [setting, value] : settings) {
    const std::size_t space = setting.find(' '), equals = setting.find('=');
    if (space != setting.npos)
      values[setting.substr(0, space)].push_back(setting.substr(space + 1) + "=" + value);
    else if (equals != setting.npos)
      values[setting.substr(0, equals)].push_back(setting.substr(equals + 1));
    else
      values[setting] = {value};
  }
  return values;
}

std::vector<std::string> words_of(const ModelSettings& settings) {
  std::vector<std::string> words;
  for (const auto& [setting, value] : settings) {
    const std::size_t space = setting.find(' ');
    if (space != setting.npos)
      words.push_back(fmt::format("--{}={}={}", setting.substr(0, space), setting.substr(space + 1), value));
    else
      words.push_back(value == "true" ? "--" + setting : fmt::format("--{}={}", setting, value));
  }
  return words;
}

std::string describe(const ModelSettings& settings) {
  std::string text;
  for (const auto& [setting, value] : settings) {
    const std::size_t space = setting.find(' ');
    if (!text.empty()) text += " ";
    if (value.empty())
      text += "without --" + setting;
    else if (space != setting.npos)
      text += fmt::format("--{} {}={}", setting.substr(0, space), setting.substr(space + 1), value);
    else
      text += value == "true" ? "--" + setting : fmt::format("--{} {}", setting, value);
  }
  return text;
}

}  // namespace tandem
