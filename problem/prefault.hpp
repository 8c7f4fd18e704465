#pragma once

#include <cstddef>

namespace tandem::detail {

/// Requests the physical pages of memory that is about to be written, in one system call and as huge pages where
/// available. Otherwise the first write to each page causes a page fault, which takes longer than filling the page,
/// especially in virtual machines. Does nothing for less than 64 KiB and on systems without this call.
void prefault(void* begin, std::size_t bytes);

/// Prefaults the first `size` elements of an array, which must be reserved. Elements that exist must be plain numbers.
template <class Array>
void prefault(Array& array, std::size_t size) {
  prefault(array.data(), size * sizeof(*array.data()));
}

}  // namespace tandem::detail
