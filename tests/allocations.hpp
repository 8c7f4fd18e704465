#pragma once

#include <cstddef>
#include <cstdlib>
#include <new>

#include "allocation_count.hpp"
#include "sanitized.hpp"

/// Counts the C and C++ heap allocations of the executable. Include it in exactly one source.
#ifdef TANDEM_SANITIZED

// The sanitizer replaces malloc and offers hooks.
extern "C" int __sanitizer_install_malloc_and_free_hooks(void (*)(const volatile void*, std::size_t),
                                                         void (*)(const volatile void*));

namespace tandem::testing {
inline const int hooked = __sanitizer_install_malloc_and_free_hooks(
    [](const volatile void*, std::size_t) { ++allocations; }, [](const volatile void*) {});
}  // namespace tandem::testing

#elif defined(__GLIBC__)

// Replaces malloc and related functions, which operator new and Eigen's aligned allocation call, and forwards to the C
// library.
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

void* malloc(std::size_t size) noexcept {
  ++tandem::testing::allocations;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) noexcept {
  ++tandem::testing::allocations;
  return __libc_calloc(count, size);
}
void* realloc(void* old, std::size_t size) noexcept {
  ++tandem::testing::allocations;
  return __libc_realloc(old, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  ++tandem::testing::allocations;
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** result, std::size_t alignment, std::size_t size) noexcept {
  ++tandem::testing::allocations;
  *result = __libc_memalign(alignment, size);
  return *result ? 0 : 12;  // ENOMEM
}
}

#else

// Other platforms: counts operator new only.
void* operator new(std::size_t size) {
  ++tandem::testing::allocations;
  if (void* p = std::malloc(size)) return p;
  throw std::bad_alloc();
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }

#endif
