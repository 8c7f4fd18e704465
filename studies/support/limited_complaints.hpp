#pragma once

#include <functional>
#include <string>

namespace tandem {

/// Passes sentences on, but not a million of them: the first ten, then how many there have been at each tenfold.
class LimitedComplaints {
 public:
  /// `about`: what there are so many of, as in "1000 ABOUT so far".
  LimitedComplaints(std::string about, std::function<void(const std::string&)> tell)
      : about_(std::move(about)), tell_(std::move(tell)) {}

  void operator()(const std::string& sentence);

 private:
  std::string about_;
  std::function<void(const std::string&)> tell_;
  std::size_t n_ = 0, next_ = 10;
};

}  // namespace tandem
