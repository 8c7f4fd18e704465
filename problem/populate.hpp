#pragma once

#include <cstddef>

namespace tandem::detail {

/// Has the system give memory that is about to be written: all at once, and in large pages where it has them. Each page
/// that is touched first is a fault otherwise, which takes longer than to fill it, in a virtual machine many times longer.
/// Of small arrays, and on systems without such a call, it does nothing.
void populate(void* begin, std::size_t bytes);

/// Of an array that has room but no elements yet, or whose elements are plain numbers.
template <class Array>
void populate(Array& array, std::size_t size) {
  populate(array.data(), size * sizeof(*array.data()));
}

}  // namespace tandem::detail
