#pragma once

#include <stdexcept>

namespace tandem {

/// Exception for invalid input. The message is one sentence that names the input, the problem and the remedy.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace tandem
