#pragma once

#include <vector>

namespace tandem::detail {

/// Places that are used again: ids of variables, slots of states, ids of blocks. Whoever keeps a place together with its
/// generation can tell later whether it is still the same one.
class Slots {
 public:
  /// A free place, the one that was given back last, or one more.
  int take() {
    if (free_.empty()) {
      generation_.push_back(0);
      taken_.push_back(true);
      return static_cast<int>(taken_.size()) - 1;
    }
    const int slot = free_.back();
    free_.pop_back();
    taken_[std::size_t(slot)] = true;
    return slot;
  }
  void give_back(int slot) {
    free_.push_back(slot);
    taken_[std::size_t(slot)] = false;
    ++generation_[std::size_t(slot)];
  }
  /// Places there have been; those that are taken are below.
  int bound() const { return static_cast<int>(taken_.size()); }
  int size() const { return bound() - static_cast<int>(free_.size()); }
  bool is_taken(int slot) const { return slot >= 0 && slot < bound() && taken_[std::size_t(slot)]; }
  /// How often the place has been given back.
  unsigned generation(int slot) const { return generation_[std::size_t(slot)]; }
  bool is_current(int slot, unsigned generation) const {
    return is_taken(slot) && generation_[std::size_t(slot)] == generation;
  }

 private:
  std::vector<int> free_;
  std::vector<unsigned> generation_;
  std::vector<char> taken_;
};

/// Values in such places.
template <class T>
class SlotVector {
 public:
  int add(const T& value = {}) {
    const int slot = slots_.take();
    if (slot == static_cast<int>(values_.size()))
      values_.push_back(value);
    else
      values_[std::size_t(slot)] = value;
    return slot;
  }
  void remove(int slot) { slots_.give_back(slot); }
  T& at(int slot) { return values_[std::size_t(slot)]; }
  const T& at(int slot) const { return values_[std::size_t(slot)]; }

 private:
  Slots slots_;
  std::vector<T> values_;
};

}  // namespace tandem::detail
