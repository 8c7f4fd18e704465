#include <fmt/format.h>

#include <tandem/studies/support/limited_warnings.hpp>

namespace tandem {

void LimitedWarnings::operator()(const std::string& sentence) {
  if (++n_ <= 10) print_(sentence);
  if (n_ != next_) return;
  print_(fmt::format("{} {} so far; the total is printed next at {}", n_, about_, 10 * next_));
  next_ *= 10;
}

}  // namespace tandem
