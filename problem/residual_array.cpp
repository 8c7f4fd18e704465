#include <algorithm>
#include <new>

#include <tandem/problem/residual_array.hpp>

namespace tandem::detail {

std::byte* ResidualArray::allocate(std::size_t capacity) const {
  return static_cast<std::byte*>(::operator new(capacity* functions_.size, std::align_val_t(functions_.alignment)));
}

void ResidualArray::release(std::byte* memory) const {
  ::operator delete(memory, std::align_val_t(functions_.alignment));
}

ResidualArray::~ResidualArray() {
  for (std::size_t i = 0; i < size_; ++i) functions_.destroy(at(i));
  release(begin_);
}

void ResidualArray::add(const void* residual) {
  if (size_ < capacity_) {
    functions_.copy(residual, at(size_));
  } else {
    const std::size_t capacity = std::max(std::size_t(8), 2 * capacity_);
    std::byte* grown = allocate(capacity);
    try {
      functions_.copy(residual, grown + size_ * functions_.size);
    } catch (...) {
      release(grown);
      throw;
    }
    for (std::size_t i = 0; i < size_; ++i) functions_.relocate(at(i), grown + i * functions_.size);
    release(begin_);
    begin_ = grown;
    capacity_ = capacity;
  }
  ++size_;
}

void ResidualArray::set(std::size_t i, const void* residual) {
  add(residual);
  remove(i);
}

void ResidualArray::remove(std::size_t i) {
  functions_.destroy(at(i));
  if (--size_ != i) functions_.relocate(at(size_), at(i));
}

}  // namespace tandem::detail
