#include <fmt/format.h>

#include <tandem/studies/support/console.hpp>
#include <tandem/studies/support/progress_line.hpp>
#include <tandem/studies/support/text.hpp>

namespace tandem {
namespace {
const char* const kEraseLine = "\r\x1b[K";
}

ProgressLine::~ProgressLine() {
  if (shown_) print_error(kEraseLine);
}

void ProgressLine::show(const Progress& progress) {
  std::string line = fmt::format("iteration {}, cost {:.8g}", progress.iteration, progress.cost);
  if (progress.violation > 0.0) line += fmt::format(", violation {:.2g}", progress.violation);
  show(fmt::format("{}, {:.1f} s", line, progress.seconds));
}

void ProgressLine::show(const std::string& text) {
  const auto now = std::chrono::steady_clock::now();
  if (shown_ && now - last_ < std::chrono::milliseconds(100)) return;
  shown_ = true;
  last_ = now;
  print_error(fmt::format("{}{}{}", kEraseLine, prefix_, printable(text)));
}

}  // namespace tandem
