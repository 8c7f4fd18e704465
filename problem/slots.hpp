#pragma once

#include <vector>

namespace tandem::detail {

/// Allocator of reusable indices for variables, states and blocks. Each index has a generation, which changes when the
/// index is freed. The holder of an index and its generation can detect that the index was reused.
class Slots {
 public:
  /// Returns a free index: the one freed last, or a new one.
  int allocate() {
    if (free_.empty()) {
      generation_.push_back(0);
      used_.push_back(true);
      return static_cast<int>(used_.size()) - 1;
    }
    const int slot = free_.back();
    free_.pop_back();
    used_[std::size_t(slot)] = true;
    return slot;
  }
  /// Frees an index.
  void release(int slot) {
    free_.push_back(slot);
    used_[std::size_t(slot)] = false;
    ++generation_[std::size_t(slot)];
  }
  /// Returns an upper bound (exclusive) of all indices in use.
  int bound() const { return static_cast<int>(used_.size()); }
  /// Returns the number of indices in use.
  int size() const { return bound() - static_cast<int>(free_.size()); }
  bool is_used(int slot) const { return slot >= 0 && slot < bound() && used_[std::size_t(slot)]; }
  /// Returns how often the index has been freed.
  unsigned generation(int slot) const { return generation_[std::size_t(slot)]; }
  /// Returns whether the index is in use and has this generation.
  bool is_current(int slot, unsigned generation) const {
    return is_used(slot) && generation_[std::size_t(slot)] == generation;
  }

 private:
  std::vector<int> free_;
  std::vector<unsigned> generation_;
  std::vector<char> used_;
};

/// Array of values at reusable indices.
template <class T>
class SlotVector {
 public:
  int add(const T& value = {}) {
    const int slot = slots_.allocate();
    if (slot == static_cast<int>(values_.size()))
      values_.push_back(value);
    else
      values_[std::size_t(slot)] = value;
    return slot;
  }
  void remove(int slot) { slots_.release(slot); }
  T& at(int slot) { return values_[std::size_t(slot)]; }
  const T& at(int slot) const { return values_[std::size_t(slot)]; }

 private:
  Slots slots_;
  std::vector<T> values_;
};

}  // namespace tandem::detail
