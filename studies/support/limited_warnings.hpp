#pragma once

#include <functional>
#include <string>

namespace tandem {

/// Prints the first 10 warnings, then only their total at 10, 100, 1000, …
class LimitedWarnings {
 public:
  /// `about` completes the sentence "1000 ABOUT so far". `print` receives each printed sentence.
  LimitedWarnings(std::string about, std::function<void(const std::string&)> print)
      : about_(std::move(about)), print_(std::move(print)) {}

  void operator()(const std::string& sentence);

 private:
  std::string about_;
  std::function<void(const std::string&)> print_;
  std::size_t n_ = 0, next_ = 10;
};

}  // namespace tandem
