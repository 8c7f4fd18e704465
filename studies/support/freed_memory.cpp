#include <cstdlib>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <tandem/studies/support/freed_memory.hpp>

namespace tandem {

void keep_freed_memory() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 32 << 20);  // the maximum that glibc accepts
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
  mallopt(M_TOP_PAD, 4 << 20);
#endif
}

}  // namespace tandem
