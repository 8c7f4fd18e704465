#include <fmt/format.h>

#include <tandem/studies/support/limited_complaints.hpp>

namespace tandem {

void LimitedComplaints::operator()(const std::string& sentence) {
  if (++n_ <= 10) tell_(sentence);
  if (n_ != next_) return;
  tell_(fmt::format("{} {} so far; from here on each tenfold is told, and all are counted", n_, about_));
  next_ *= 10;
}

}  // namespace tandem
