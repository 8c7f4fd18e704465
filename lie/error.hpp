#pragma once

#include <stdexcept>

namespace tandem {

/// What Tandem throws on input it cannot use: one sentence that names the culprit and says what to do.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace tandem
