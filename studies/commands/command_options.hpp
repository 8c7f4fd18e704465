#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace CLI {
class App;
}

namespace tandem {

/// The options of one command, each registered once: what it is called, what it takes, what it does, where its value goes
/// and what reads it. A parser is `T parse(const std::string& option, const std::string& text)` as in option_values.hpp:
/// it throws Error that names the option. Values are read in the order of registration, whatever the order on the command
/// line, once the whole of it has been understood. Variables must live until then.
class CommandOptions {
 public:
  explicit CommandOptions(CLI::App& app);
  CommandOptions(const CommandOptions&) = delete;

  /// What `--help` says at its end.
  void footer(const std::string& text);
  /// The options that follow stand under this heading in `--help`.
  void group(const std::string& heading) { group_ = heading; }

  /// A word without dashes, which must be there.
  void argument(const std::string& name, const std::string& takes, const std::string& help, std::string& value);

  /// Any number of them, after the others.
  void arguments(const std::string& name, const std::string& takes, const std::string& help,
                 std::vector<std::string>& values);

  /// An option with a value, given once or not at all.
  template <class T, class Parse>
  void operator()(const std::string& name, const std::string& takes, const std::string& help, T& value, Parse parse) {
    each(name, takes, help, Times::once,
         [&value, parse](const std::string& option, const std::string& text) { value = parse(option, text); });
  }
  /// The same where it must be there.
  template <class T, class Parse>
  void required(const std::string& name, const std::string& takes, const std::string& help, T& value, Parse parse) {
    each(name, takes, help, Times::required,
         [&value, parse](const std::string& option, const std::string& text) { value = parse(option, text); });
  }
  /// An option that may be given again and again.
  template <class T, class Parse>
  void repeatable(const std::string& name, const std::string& takes, const std::string& help, std::vector<T>& values,
                  Parse parse) {
    each(name, takes, help + "; repeatable", Times::any,
         [&values, parse](const std::string& option, const std::string& text) {
           values.push_back(parse(option, text));
         });
  }
  /// An option whose value is not all that it sets.
  using Set = std::function<void(const std::string& option, const std::string& text)>;
  void set(const std::string& name, const std::string& takes, const std::string& help, Set set) {
    each(name, takes, help, Times::once, std::move(set));
  }
  void set_repeatedly(const std::string& name, const std::string& takes, const std::string& help, Set set) {
    each(name, takes, help + "; repeatable", Times::any, std::move(set));
  }
  /// One without a value.
  void flag(const std::string& name, const std::string& help, bool& value);
  void flag(const std::string& name, const std::string& help, std::function<void()> set);
  /// One that `--help` does not tell: for the program's own use.
  void hidden(const std::string& name, std::string& value);

  /// The options under a heading that were given.
  std::vector<std::string> given(const std::string& heading) const;
  /// The words after the command's name, as typed.
  const std::vector<std::string>& words() const { return words_; }

  /// For the command line: reads the values. Throws what the parsers throw.
  void read(std::vector<std::string> words);

 private:
  enum class Times { once, required, any };
  void each(const std::string& name, const std::string& takes, const std::string& help, Times times, Set set);

  CLI::App& app_;
  std::string group_ = "Options";
  std::vector<std::function<void()>> reads_;
  std::vector<std::string> words_;
};

}  // namespace tandem
