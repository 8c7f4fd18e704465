#pragma once

#include <cstddef>

#include <tandem/residuals/residual_functions.hpp>

namespace tandem::detail {

/// Residuals of one type that is known at run time, stored contiguously.
class ResidualArray {
 public:
  explicit ResidualArray(const ResidualFunctions& functions) : functions_(functions) {}
  ResidualArray(const ResidualArray&) = delete;
  ResidualArray& operator=(const ResidualArray&) = delete;
  ~ResidualArray();

  std::size_t size() const { return size_; }
  const void* operator[](std::size_t i) const { return begin_ + i * functions_.size; }
  /// Appends a copy of a residual, which may be an element.
  void add(const void* residual);
  /// Replaces element i by a copy of a residual.
  void set(std::size_t i, const void* residual);
  /// Removes element i. The last element takes its index.
  void remove(std::size_t i);

 private:
  void* at(std::size_t i) { return begin_ + i * functions_.size; }
  std::byte* allocate(std::size_t capacity) const;
  void release(std::byte* memory) const;

  const ResidualFunctions& functions_;
  std::byte* begin_ = nullptr;
  std::size_t size_ = 0, capacity_ = 0;
};

}  // namespace tandem::detail
