#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace CLI {
class App;
}

namespace tandem {

/// An option or positional argument as help texts and the reference show it.
struct OptionInfo {
  std::string name;   ///< "-o,--out", or "scenario" of a positional argument
  std::string takes;  ///< placeholder of the value; empty for a flag
  /// Description: a sentence without its full stop, and further ones if it needs explanation. `--help` shows the first
  /// sentence, `--help-all` and the reference show all.
  std::string help;
  std::string group;
  bool advanced = false;  ///< `--help` hides it, `--help-all` shows it
  bool positional = false, required = false, repeatable = false;

  /// Returns "out": the key of a run file.
  std::string key() const;
};

/// Returns the text up to the first full stop that another sentence follows.
std::string_view first_sentence(std::string_view text);

/// The options of one command. Each option has a name, a placeholder for its value (`takes`), a help text, a variable
/// and a parser `T parse(const std::string& option, const std::string& text)`, as in option_values.hpp. A parser throws
/// Error with the option name.
///
/// A name may have a short form: "-o,--out". Parsers get the long one.
///
/// Values are parsed after the whole command line is known to be valid, in the order of registration. The variables
/// must exist until then.
class CommandOptions {
 public:
  explicit CommandOptions(CLI::App& app);
  CommandOptions(const CommandOptions&) = delete;

  /// Sets an explanation after the options in `--help`.
  void footer(const std::string& text) { footer_ = text; }
  const std::string& footer() const { return footer_; }
  /// Sets a further explanation that only `--help-all` and the reference show.
  void details(const std::string& text) { details_ = text; }
  const std::string& details() const { return details_; }
  /// Replaces the sentence about the exit status.
  void exit_status(const std::string& text) { exit_status_ = text; }
  const std::string& exit_status() const { return exit_status_; }
  /// Sets the heading in `--help` for the options added next.
  void group(const std::string& heading) {
    group_ = heading;
    advanced_ = false;
  }
  /// Makes `--help` hide the options that are added next, up to the next group() or everyday(). `--help-all` shows
  /// them after the everyday options of the group.
  void advanced() { advanced_ = true; }
  /// Ends advanced().
  void everyday() { advanced_ = false; }

  /// Adds a required positional argument.
  void argument(const std::string& name, const std::string& takes, const std::string& help, std::string& value);

  /// Adds any number of optional positional arguments after the others.
  void arguments(const std::string& name, const std::string& takes, const std::string& help,
                 std::vector<std::string>& values);

  /// Adds an option with a value that is given at most once.
  template <class T, class Parse>
  void operator()(const std::string& name, const std::string& takes, const std::string& help, T& value, Parse parse) {
    add_option(name, takes, help, Times::once,
               [&value, parse](const std::string& option, const std::string& text) { value = parse(option, text); });
  }
  /// Adds a required option with a value.
  template <class T, class Parse>
  void required(const std::string& name, const std::string& takes, const std::string& help, T& value, Parse parse) {
    add_option(name, takes, help, Times::required,
               [&value, parse](const std::string& option, const std::string& text) { value = parse(option, text); });
  }
  /// Adds an option that may be given several times; its values are appended.
  template <class T, class Parse>
  void repeatable(const std::string& name, const std::string& takes, const std::string& help, std::vector<T>& values,
                  Parse parse) {
    add_option(name, takes, help, Times::any, [&values, parse](const std::string& option, const std::string& text) {
      values.push_back(parse(option, text));
    });
  }
  using Set = std::function<void(const std::string& option, const std::string& text)>;
  /// Adds an option with a value that `set` parses and stores.
  void set(const std::string& name, const std::string& takes, const std::string& help, Set set) {
    add_option(name, takes, help, Times::once, std::move(set));
  }
  /// Adds such an option that may be given several times.
  void set_repeatedly(const std::string& name, const std::string& takes, const std::string& help, Set set) {
    add_option(name, takes, help, Times::any, std::move(set));
  }
  /// Adds an option without a value.
  void flag(const std::string& name, const std::string& help, bool& value);
  void flag(const std::string& name, const std::string& help, std::function<void()> set);
  /// Adds an option for internal use, which `--help` does not show.
  void hidden(const std::string& name, std::string& value);

  /// Adds a function that read() calls after all values are parsed.
  void after_reading(std::function<void()> check) { checks_.push_back(std::move(check)); }
  /// Sets the names of the files that the command may write to its output folder, as far as they are known beforehand.
  void set_result_files(std::vector<std::string> names) { result_files_ = std::move(names); }
  const std::vector<std::string>& result_files() const { return result_files_; }

  /// Returns the names of the options under a heading that were given.
  std::vector<std::string> given(const std::string& heading) const;
  /// Returns the options that were given, with their values as typed. For run_command(), after parsing.
  std::vector<std::pair<OptionInfo, std::vector<std::string>>> given() const;
  /// Returns all options that are not hidden, in the order of registration.
  const std::vector<OptionInfo>& infos() const { return infos_; }
  /// Returns the words after the command name, those of a run file first.
  const std::vector<std::string>& words() const { return words_; }

  /// Says that the value of an option comes from a run file: `place` is its "FILE:LINE" for error messages.
  void set_place(const std::string& key, std::string place) { places_[key] = std::move(place); }
  /// Parses the values. Called by run_command(). Throws what the parsers throw.
  void read(std::vector<std::string> words);

 private:
  enum class Times { once, required, any };
  void add_option(const std::string& name, const std::string& takes, const std::string& help, Times times, Set set);

  CLI::App& app_;
  std::string group_ = "Options", footer_, details_;
  std::string exit_status_ =
      "Exit status: 0 converged, 1 invalid input or usage, 2 not converged, stopped early or no result.";
  bool advanced_ = false;
  std::vector<OptionInfo> infos_;
  std::vector<std::function<void()>> reads_, checks_;
  std::vector<std::string> words_, result_files_;
  std::map<std::string, std::string> places_;  ///< places of the keys that a run file gives
};

}  // namespace tandem
